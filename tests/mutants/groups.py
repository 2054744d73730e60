"""Groups of modules where numbers are made, and the tests nearest to each."""

GROUPS: dict[str, tuple[str, str]] = {
    "engine": (
        "bns/engine/[!_rj]*.py bns/engine/rprop.py",
        "tests/engine tests/robots/test_snake_breeding.py tests/diagnose/predict/test_pose_filter.py",
    ),
    "tasks": (
        "bns/tasks/__init__.py bns/robots/khepera/robot.py",
        "tests/robots/test_task_files.py tests/robots/test_khepera.py tests/robots/test_contract.py",
    ),
    "store": (
        "bns/store/disk/*.py bns/store/write/*.py bns/store/read/*.py",
        "tests/store/test_damage.py tests/store/test_order.py tests/store/test_journal.py tests/store/test_compact.py "
        "tests/store/test_round_trip.py tests/store/test_lock.py tests/store/test_question.py tests/store/test_disk.py",
    ),
    "estimate": (
        "bns/diagnose/estimate/*.py",
        "tests/diagnose/estimate/test_held_out.py tests/diagnose/estimate/test_evidence.py "
        "tests/diagnose/estimate/test_clocks.py tests/diagnose/estimate/test_normal.py "
        "tests/diagnose/estimate/test_formula_starts.py tests/jointed/test_stretch_noise.py "
        "tests/jointed/test_screening.py tests/jointed/test_look_around.py tests/diagnose/estimate/test_intervals.py "
        "tests/diagnose/estimate/test_smoothing_tracker.py tests/diagnose/estimate/test_cancelling.py "
        "tests/diagnose/estimate/test_plausibility.py "
        "tests/diagnose/estimate/test_relative_motions.py::test_sizes_of_wheels_and_their_intervals_follow_from_mean_and_ratio",
    ),
    "select": (
        "bns/diagnose/select/*.py",
        "tests/diagnose/select/test_alike.py tests/diagnose/select/test_negligible.py "
        "tests/diagnose/select/test_equivalents.py tests/diagnose/select/test_search.py "
        "tests/diagnose/select/test_exchanges.py tests/diagnose/select/test_extending.py "
        "tests/jointed/test_screening.py",
    ),
    "safety": (
        "bns/hardware/safety.py",
        "tests/hardware/stopping/test_safety.py tests/hardware/stopping/test_safety_edges.py "
        "tests/hardware/stopping/test_confirmed_stop.py",
    ),
    "drivers": (
        "bns/hardware/wheels/khepera.py bns/hardware/servos/dynamixel.py bns/hardware/servos/servo_chain.py "
        "bns/hardware/servos/bridge.py bns/hardware/servos/packets.py bns/hardware/servos/servo_table.py",
        "tests/hardware/stopping/test_confirmed_stop.py tests/hardware/wheels/test_khepera.py "
        "tests/hardware/wheels/test_khepera_asks.py tests/hardware/servos/test_ax12.py tests/hardware/servos/test_bridge.py "
        "tests/hardware/servos/test_x430.py tests/hardware/servos/test_packets.py tests/hardware/servos/test_servo_chain.py",
    ),
}
"""Name -> files that are changed, tests that must notice; patterns with spaces between."""
