# Every target that needs Python sets up .venv by itself; PYTHON chooses the interpreter (3.11 or newer).
PYTHON  ?= python3
VENV    ?= .venv
BIN     := $(VENV)/bin
RESULTS ?= results
BUDGET  ?=
JOBS    ?=
ONLY    ?=
DATA    ?=
FROM    ?=
PART    ?=
STAMP   := $(VENV)/.installed
# The CPU build: a tagged wheel where one is at hand, else from PyTorch's own index. Never the CUDA packages.
TORCH   := torch==2.13.0

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help setup test test-slow lint dist docs sweep-khepera sweep-budget figures bench bench-check bench-gpu compare-gpu contact-worlds hidden-effects precompute soak-dask fuzz clean sweep-snake soak real-robots propose-benchmark closing-the-gap mutants replication ranking-check

help: ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):[^#]*## (.*)/\1\t\2/' | awk -F'\t' '{printf "  make %-18s %s\n", $$1, $$2}'
	@echo "  variables: BUDGET=10m (time for a sweep; none: until done)  JOBS=2  RESULTS=results  ONLY=name (one figure)"

setup: $(STAMP) ## virtual environment in .venv with everything but CUDA (does nothing when it is up to date)

$(STAMP): pyproject.toml setup.py constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "bns needs Python 3.11 or newer; this is %d.%d. Try: make PYTHON=python3.12" % sys.version_info[:2])'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -c 'import torch' 2>/dev/null || $(BIN)/pip install -q --disable-pip-version-check "$(TORCH)+cpu" 2>/dev/null \
		|| $(BIN)/pip install --disable-pip-version-check --index-url https://download.pytorch.org/whl/cpu "$(TORCH)"
	$(BIN)/pip install -q --disable-pip-version-check -c constraints.txt -e '.[all,docs,test,lint,bench]'
	@touch $@

test: setup ## the tests, all but the slow ones
	$(BIN)/python -m pytest -n 3 --dist worksteal -q -m "not slow"

test-slow: setup ## the tests that go end to end or over many cases; with make test these are all. PART=1/2: half of them
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m slow $(if $(PART),--part $(PART))

lint: setup ## style and types
	$(BIN)/ruff check .
	$(BIN)/mypy

docs: setup ## the documentation site, into site/: open site/index.html (no network is needed)
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet

clean: ## remove the virtual environment and caches (never the results)
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache build dist site *.egg-info
	find . -name __pycache__ -prune -exec rm -rf {} +

SWEEP = $(BIN)/bns sweep $(if $(BUDGET),--budget "$(BUDGET)") $(if $(JOBS),--jobs "$(JOBS)") --results "$(RESULTS)"

dist: setup ## wheel and sdist, into dist/
	$(BIN)/python -m build --no-isolation

sweep-khepera: setup ## the Khepera study: prototype trials, small slice, all 45,000 runs; BUDGET=10m stops in time
	$(SWEEP) sweeps/prototype.yaml sweeps/khepera-small.yaml sweeps/khepera.yaml

sweep-snake: setup ## the snake study: trials in physics, small slice, all 30,000 runs; BUDGET=10m stops in time
	$(SWEEP) sweeps/snake-prototype.yaml sweeps/snake-small.yaml sweeps/snake.yaml

sweep-budget: setup ## how much evolution and training an evaluation should get
	$(SWEEP) sweeps/budget.yaml

figures: setup ## page and figures of whatever results there are, into results/figures; ONLY=success-by-mutation for one; FROM=published: of the published study
	$(BIN)/bns figures --results "$(RESULTS)" $(if $(FROM),--from "$(FROM)") $(if $(ONLY),--only "$(ONLY)")

replication: setup ## docs/replication.md, what of the dissertation replicates, from the published archive; FRESH=1: from results
	$(BIN)/python -m analysis.replication --results "$(RESULTS)" $(if $(FRESH),--fresh)

bench: setup ## speed, as ratios against named peers measured in the same run
	$(BIN)/python -m tests.bench --json "$(RESULTS)/bench.json"

bench-check: setup ## is a ratio of the last `make bench` worse by 15 % than the committed one (tests/bench/ratios.csv)?
	$(BIN)/python -m tests.bench.ratios "$(RESULTS)/bench.json"

bench-gpu: setup ## both studies on this machine's GPU, from slices of them (needs: pip install -e '.[cuda]' in .venv)
	$(BIN)/python -m tests.bench.gpu --json "$(RESULTS)/bench-gpu.json"

compare-gpu: setup ## 200 runs a side and robot on GPU and CPU: do success, diversity and fitness error differ? (needs a GPU likewise)
	$(BIN)/python -m tests.bench.devices --json "$(RESULTS)/compare-gpu.json"

contact-worlds: setup ## the same for robots with contact physics (MuJoCo), a quarter of an hour
	$(BIN)/python -m tests.contact_worlds "$(RESULTS)/contact-worlds" $(if $(ONLY),--only "$(ONLY)")

hidden-effects: setup ## does the diagnosis name what is missing? Generated worlds, half an hour; QUICK=1 for a look in minutes
	$(BIN)/python -m tests.hidden_effects --results "$(RESULTS)/hidden-effects" $(if $(QUICK),--quick) $(if $(ONLY),--only "$(ONLY)")

GAP = docs/closing-the-gap
OUT = results/closing-the-gap
closing-the-gap: setup ## from a run on a robot to an extended model, and how controllers of either do on the robot (minutes)
	@mkdir -p $(OUT)
	$(BIN)/bns run --world $(GAP)/robot.yaml --task circle --seed 1000 --evaluations 30 --measurements $(OUT)/log.parquet \
		--save-snn $(OUT)/networks.safetensors --results $(OUT)
	$(BIN)/bns diagnose $(OUT)/log.parquet --model $(GAP)/drawing.yaml --figures $(OUT)/figures
	$(BIN)/bns add $(OUT)/log.parquet wheel-mismatch motor-lag --model $(GAP)/drawing.yaml -o $(OUT)/extended.yaml --figures $(OUT)/figures
	$(BIN)/bns sweep $(GAP)/before.yaml $(GAP)/after.yaml $(GAP)/direct.yaml --results $(OUT)
	$(BIN)/python -m analysis.transfer "gap-before=the user's model" "gap-after=the extended model" \
		--reference "gap-direct=the robot itself" --to $(GAP)/robot.yaml --results $(OUT) --out $(OUT)/figures

propose-benchmark: setup ## robot time until confusable explanations are told apart: proposed commands against random ones
	$(BIN)/python -m tests.hidden_effects.proposing --results "$(RESULTS)/propose" $(if $(ONLY),--only "$(ONLY)")
	$(BIN)/python -m tests.hidden_effects.deciding --results "$(RESULTS)/deciding" $(if $(ONLY),--only "$(ONLY)")

real-robots: setup ## what a plain model lacks on logs of real robots: numbers and a figure; DATA=folder that holds them
	$(BIN)/python -m analysis.real_robots --data "$(or $(DATA),../shared/data)" --out "$(RESULTS)/real-robots" $(if $(ONLY),--only "$(ONLY)")

soak: setup ## 200 emulated trials of each robot with faults at random: how they end
	$(BIN)/python -m tests.hardware.soak khepera 200
	$(BIN)/python -m tests.hardware.soak snake 200

fuzz: setup ## files that nobody would write, for every reader of users' files, and damages to result files: five minutes
	BNS_FUZZ_EXAMPLES=1500 $(BIN)/python -m pytest -q tests/fuzz
	$(BIN)/python -m tests.store.damages 60

ranking-check: setup ## how many runs `--until ranking` needs, and how often it finds the same winners: 100 studies of each kind, ten minutes
	$(BIN)/python -m tests.sweep.ranking_study

mutants: setup ## small faults planted in the modules where numbers are made: do the tests notice? MINUTES=20; writes docs/mutants.md
	$(BIN)/pip install -q --disable-pip-version-check -c constraints.txt -e '.[mutants]'
	$(BIN)/python -m tests.mutants --minutes $(or $(MINUTES),20)

soak-dask: setup ## twenty minutes of a sweep on Dask whose workers are killed: what it costs, and that no run is lost
	$(BIN)/python tests/sweep/soak_dask.py

precompute: setup ## rebuild the static simulators that ship in the package
	$(BIN)/bns precompute --robot khepera
	$(BIN)/bns precompute --robot snake
