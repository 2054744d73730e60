"use strict";
// Paths of one trial with a slider through time. The data are millimetres, x and y in turn, beside the times of the poses.
(() => {
  const trials = JSON.parse(document.getElementById("data").textContent);
  const kinds = ["before", "measured", "after"].filter(kind => trials[0][kind]);
  const looks = {measured: ["#000", ""], before: ["#d55e00", "6 4"], after: ["#0072b2", ""]};
  const at = id => document.getElementById(id);
  const make = (name, attributes, parent) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return parent.appendChild(made);
  };
  const [floor, course] = ["floor", "course"].map(at);
  let trial = trials[0], timer = null;

  const place = (kind, k) => [trial[kind][2 * k], trial[kind][2 * k + 1]];
  const error = (kind, k) => Math.hypot(place(kind, k)[0] - place("measured", k)[0], place(kind, k)[1] - place("measured", k)[1]);
  const nice = size => [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000].find(step => step >= size) || 10000;
  const path = (points) => points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(1)},${y.toFixed(1)}`).join("");

  function drawFloor() {
    floor.replaceChildren();
    const all = kinds.flatMap(kind => trial.t.map((_, k) => place(kind, k)));
    const xs = all.map(p => p[0]), ys = all.map(p => p[1]);
    const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const width = 600, height = 400, scale = Math.min(540 / Math.max(x1 - x0, 20), 330 / Math.max(y1 - y0, 20));
    const on = ([x, y]) => [width / 2 + scale * (x - (x0 + x1) / 2), height / 2 - 10 - scale * (y - (y0 + y1) / 2)];
    const bar = nice(90 / scale);
    make("path", {d: `M20,385h${bar * scale}`, stroke: "#555", "stroke-width": 3}, floor);
    make("text", {x: 26 + bar * scale, y: 390, "font-size": 16, fill: "#555"}, floor).textContent =
      bar >= 1000 ? `${bar / 1000} m` : bar >= 10 ? `${bar / 10} cm` : `${bar} mm`;
    for (const kind of kinds) {
      const [stroke, dash] = looks[kind];
      make("path", {d: path(trial.t.map((_, k) => on(place(kind, k)))), fill: "none", stroke, "stroke-width": kind === "measured" ? 3 : 2,
                    "stroke-dasharray": dash, opacity: .75}, floor);
    }
    const [sx, sy] = on(place("measured", 0));
    make("circle", {cx: sx, cy: sy, r: 6, fill: "#fff", stroke: "#000", "stroke-width": 2}, floor);
    const turned = sx > width - 80;  // no room for the word to the right
    make("text", {x: turned ? sx - 9 : sx + 9, y: sy - 9, "font-size": 16, "text-anchor": turned ? "end" : "start"}, floor)
      .textContent = "start";
    return kinds.map(kind => [kind, make("circle", {r: 7, fill: looks[kind][0], stroke: "#fff", "stroke-width": 2}, floor), on]);
  }

  function drawCourse() {
    course.replaceChildren();
    const rivals = kinds.filter(kind => kind !== "measured");
    const most = Math.max(1, ...rivals.flatMap(kind => trial.t.map((_, k) => error(kind, k))));
    const last = trial.t[trial.t.length - 1] || 1;
    const on = (t, e) => [84 + 496 * t / last, 118 - 100 * e / most];
    make("path", {d: "M84,18V118H580", fill: "none", stroke: "#999"}, course);
    const text = (x, y, said, anchor) =>
      make("text", {x, y, "font-size": 15, fill: "#555", "text-anchor": anchor}, course).textContent = said;
    text(90, 24, `${Math.round(most)} mm`, "start");
    text(78, 122, "0", "end");
    text(580, 146, `${last.toFixed(1)} s`, "end");
    text(84, 146, "position error against time", "start");
    for (const kind of rivals) {
      const d = path(trial.t.map((t, k) => on(t, error(kind, k))));
      make("path", {d, fill: "none", stroke: looks[kind][0], "stroke-dasharray": looks[kind][1], "stroke-width": 2}, course);
    }
    return [make("path", {stroke: "#000", "stroke-width": 1}, course), on];
  }

  let dots = [], cursor = null;
  function show() {
    const k = +at("time").value;
    for (const [kind, dot, on] of dots) {
      const [x, y] = on(place(kind, k));
      dot.setAttribute("cx", x);
      dot.setAttribute("cy", y);
    }
    const [x] = cursor[1](trial.t[k], 0);
    cursor[0].setAttribute("d", `M${x},14V118`);
    const words = {before: "model as given", after: "extended model"};
    at("now").textContent = `error at ${trial.t[k].toFixed(1)} s: ` + kinds.filter(kind => kind !== "measured")
      .map(kind => `${words[kind]} ${Math.round(error(kind, k))} mm`).join(", ");
  }

  function fillTable() {
    const names = {measured: "measured", before: "as given", after: "extended"};
    const head = ["t (s)", ...kinds.flatMap(kind => [`${names[kind]} x (mm)`, "y (mm)"])];
    const rows = trial.t.map((t, k) => [t, ...kinds.flatMap(kind => place(kind, k))]);
    const row = (cells, kind) => `<tr>${cells.map(cell => `<${kind}>${cell}</${kind}>`).join("")}</tr>`;
    at("poses").innerHTML = `<thead>${row(head, "th")}</thead><tbody>${rows.map(cells => row(cells, "td")).join("")}</tbody>`;
  }

  function choose(index) {
    trial = trials[index];
    at("time").max = trial.t.length - 1;
    at("time").value = trial.t.length - 1;
    [dots, cursor] = [drawFloor(), drawCourse()];
    fillTable();
    show();
  }

  function play() {
    if (timer) { clearInterval(timer); timer = null; at("play").textContent = "play"; return; }
    at("play").textContent = "pause";
    if (at("time").value === at("time").max) at("time").value = 0;
    timer = setInterval(() => {
      at("time").value = +at("time").value + 1;
      show();
      if (at("time").value === at("time").max) play();
    }, 60);
  }

  trials.forEach((one, i) => at("trial").add(new Option(`trial ${one.name}`, i)));
  at("trial").addEventListener("change", event => choose(+event.target.value));
  at("time").addEventListener("input", show);
  at("play").addEventListener("click", play);
  choose(0);
})();
