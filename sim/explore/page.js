"use strict";
// The page of an exploration. What needs no browser is in `logic`, for its tests.

const logic = {
  // Whether a row is within every demand; a figure that is not known is in none.
  meets(row, demands) {
    return !row.refused && demands.every(({ name, sign, limit }) => {
      const value = row.figures[name];
      if (value === undefined || value === null || !Number.isFinite(limit)) return !Number.isFinite(limit);
      return { "<": value < limit, "<=": value <= limit, ">": value > limit, ">=": value >= limit }[sign];
    });
  },

  // The clock, MHz, from which on a row's cycles meet a demand on a time; NaN where none is missed.
  needed(row, { name, sign, limit }) {
    const f = row.figures, missed = limit > 0 && !logic.meets({ figures: f }, [{ name, sign, limit }]);
    if (missed && sign.startsWith("<") && ["us", "own_us"].includes(name)) return f.cycles / limit;
    return missed && sign.startsWith(">") && name === "rate" ? (f.interval * limit) / 1e6 : NaN;
  },

  // Rows of which no other is better in one figure and at least as good in the other.
  front(rows, x, y) {
    const cost = (row, q) => (q.more ? -row.figures[q.name] : row.figures[q.name]);
    const better = (a, b) => cost(a, x) <= cost(b, x) && cost(a, y) <= cost(b, y)
      && (cost(a, x) < cost(b, x) || cost(a, y) < cost(b, y));
    return rows.filter((row) => !rows.some((other) => better(other, row)))
      .sort((a, b) => a.figures[x.name] - b.figures[x.name] || a.figures[y.name] - b.figures[y.name]);
  },

  shown(rows, x, y, logs) {
    const drawn = (value, log) => Number.isFinite(value) && (!log || value > 0);
    return rows.filter((row) => drawn(row.figures[x], logs[0]) && drawn(row.figures[y], logs[1]));
  },

  // Limits of an axis and the places of its marks.
  axis(values, log) {
    let low = Math.min(...values), high = Math.max(...values);
    if (log) {
      const pad = Math.max((high / low) ** 0.07, 1.06), ticks = [];
      low /= pad; high *= pad;
      const steps = high / low > 1e4 ? [1] : high / low > 30 ? [1, 3] : [1, 1.5, 2, 3, 4, 5, 6, 8];
      for (let k = Math.floor(Math.log10(low)); k <= Math.log10(high); k++) {
        for (const s of steps) if (s * 10 ** k >= low && s * 10 ** k <= high) ticks.push(s * 10 ** k);
      }
      return { low, high, ticks, log };
    }
    const span = high - low || Math.abs(high) || 1;
    low -= 0.06 * span; high += 0.06 * span;
    const raw = (high - low) / 6, ten = 10 ** Math.floor(Math.log10(raw));
    const step = ten * [1, 2, 5, 10].find((m) => m * ten >= raw), ticks = [];
    for (let k = Math.ceil(low / step); k * step <= high; k++) ticks.push(k * step);
    return { low, high, ticks, log };
  },

  place(axis, value) {
    return axis.log
      ? Math.log(value / axis.low) / Math.log(axis.high / axis.low)
      : (value - axis.low) / (axis.high - axis.low);
  },

  text(value) {
    if (value === undefined) return "\u2014";
    if (value === null) return "no number";
    if (Number.isInteger(value) && Math.abs(value) < 1e9) return String(value).replace(/\B(?=(\d{3})+$)/g, "\u202f");
    const size = Math.abs(value);
    return size >= 1e-3 && size < 1e6 ? String(Number(value.toPrecision(4))) : value.toExponential(2);
  },

  // What the address of the page keeps: what was set, so that it is there after a reload.
  address(set) {
    const list = set.demands.map((d) => d.name + d.sign + d.limit).join(",");
    return "#" + new URLSearchParams({
      x: set.x, y: set.y, logx: Number(set.logx), logy: Number(set.logy), want: list, at: set.at ?? "", by: set.by ?? "",
    });
  },

  restored(address, set) {
    const got = new URLSearchParams(address.slice(1));
    if (!got.has("x")) return set;
    const demands = (got.get("want") || "").split(",").map((text) => /^([\w.]+)(<=|>=|<|>)(.+)$/.exec(text))
      .filter(Boolean).map(([, name, sign, limit]) => ({ name, sign, limit: Number(limit) }));
    return {
      ...set, x: got.get("x"), y: got.get("y"), logx: got.get("logx") === "1", logy: got.get("logy") === "1",
      demands, at: got.get("at") || null, by: got.get("by") || null,
    };
  },
};

const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8a8f98"];
const SHAPES = [
  "M-5,0a5,5 0 1,0 10,0a5,5 0 1,0 -10,0", "M-4.6,-4.6h9.2v9.2h-9.2z", "M0,-6l5.6,10h-11.2z", "M0,-6.2l6.2,6.2l-6.2,6.2l-6.2,-6.2z",
];

function start() {
  const data = JSON.parse(document.getElementById("data").textContent);
  const byName = Object.fromEntries(data.quantities.map((q) => [q.name, q]));
  const series = [...new Set(data.rows.map((row) => row.series))];
  const targets = [...new Set(data.rows.map((row) => row.target))];
  const at = (id) => document.getElementById(id);
  const make = (tag, parent, settings = {}, text = "") => {
    const svg = ["svg", "g", "path", "line", "text", "title"].includes(tag);
    const element = svg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
    for (const [key, value] of Object.entries(settings)) element.setAttribute(key, value);
    element.textContent = text;
    return parent.appendChild(element);
  };
  const withUnit = (q, value) => logic.text(value) + (q.unit && value !== undefined && value !== null ? ` ${q.unit}` : "");
  const have = (name) => data.rows.some((row) => Number.isFinite(row.figures[name]));
  const first = (...names) => names.find((name) => name in byName && have(name)) ?? data.quantities[0]?.name;
  const limits = data.demands.map((d) => d.name).filter((name) => name !== "tolerance");
  // What a figure is called where there is no room for its title.
  const label = (name) => (name === "tolerance" ? "error / tolerance" : name);
  const up = first(...limits.filter((name) => !["lut", "dsp", "us", "cycles"].includes(name)), "attitude", "tolerance");
  const across = first(...[data.least, "lut", "cycles", "word"].filter((name) => name && name !== up));
  let set = { x: across, y: up, logx: false, logy: true, demands: data.demands, at: null, by: null };
  set = logic.restored(location.hash, set);
  for (const name of ["x", "y"]) if (!(set[name] in byName)) set[name] = name === "x" ? across : up;
  set.demands = set.demands.filter((d) => d.name in byName);

  at("state").textContent = data.left
    ? `${data.left} pieces of work left; this page loads itself again`
    : `${data.rows.length} combinations, all measured`;
  for (const line of data.lines) make("li", at("lines"), {}, line);

  for (const id of ["x", "y"]) {
    for (const q of data.quantities) make("option", at(id), { value: q.name }, `${q.title}${q.unit ? ` [${q.unit}]` : ""}`);
    at(id).addEventListener("change", () => { set[id] = at(id).value; draw(); });
    at(`log${id}`).addEventListener("change", () => { set[`log${id}`] = at(`log${id}`).checked; draw(); });
  }

  function drawDemands() {
    const box = at("demands");
    box.replaceChildren();
    make("b", box, {}, "demands");
    set.demands.forEach((demand, k) => {
      const part = make("span", box, { class: "demand" });
      make("span", part, { title: byName[demand.name].title }, label(demand.name));
      const sign = make("select", part, { "aria-label": `sign of ${demand.name}` });
      for (const s of ["<", "<=", ">", ">="]) make("option", sign, s === demand.sign ? { selected: "" } : {}, s);
      sign.addEventListener("change", () => { demand.sign = sign.value; draw(); });
      const limit = make("input", part, { type: "number", step: "any", value: demand.limit, "aria-label": `limit of ${demand.name}` });
      limit.addEventListener("input", () => { demand.limit = limit.value === "" ? NaN : Number(limit.value); draw(); });
      make("span", part, {}, byName[demand.name].unit);
      const gone = make("button", part, { "aria-label": `without the demand on ${demand.name}` }, "\u00d7");
      gone.addEventListener("click", () => { set.demands.splice(k, 1); drawDemands(); draw(); });
    });
    const more = make("select", box, { id: "more", "aria-label": "add a demand" });
    make("option", more, { value: "" }, "add a demand\u2026");
    for (const q of data.quantities) make("option", more, { value: q.name }, q.title);
    more.addEventListener("change", () => {
      const q = byName[more.value];
      const values = data.rows.map((row) => row.figures[q.name]).filter(Number.isFinite).sort((a, b) => a - b);
      set.demands.push({ name: q.name, sign: q.more ? ">=" : "<=", limit: values[Math.floor(values.length / 2)] });
      drawDemands(); draw();
    });
  }

  function plot(target, rows, xs, ys) {
    const [width, height, left, bottom] = [560, 380, 74, 44];
    const figure = make("figure", at("plots"));
    if (targets.length > 1) make("figcaption", figure, {}, target);
    const svg = make("svg", figure, { viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": `combinations for ${target}` });
    const px = (value) => left + logic.place(xs, value) * (width - left - 34);
    const py = (value) => height - bottom - logic.place(ys, value) * (height - bottom - 14);
    const base = height - bottom;
    for (const t of xs.ticks) {
      make("line", svg, { class: "grid", x1: px(t), x2: px(t), y1: 14, y2: base });
      make("text", svg, { x: px(t), y: base + 15, "text-anchor": "middle" }, logic.text(t));
    }
    for (const t of ys.ticks) {
      make("line", svg, { class: "grid", x1: left, x2: width - 34, y1: py(t), y2: py(t) });
      make("text", svg, { x: left - 6, y: py(t) + 4, "text-anchor": "end" }, logic.text(t));
    }
    make("line", svg, { class: "axis", x1: left, x2: width - 34, y1: base, y2: base });
    make("line", svg, { class: "axis", x1: left, x2: left, y1: 14, y2: base });
    const name = (q) => `${q.title}${q.unit ? ` [${q.unit}]` : ""}`;
    make("text", svg, { x: (left + width - 34) / 2, y: height - 8, "text-anchor": "middle" }, name(byName[set.x]));
    make("text", svg, { transform: `translate(13,${(14 + base) / 2}) rotate(-90)`, "text-anchor": "middle" }, name(byName[set.y]));
    const inside = rows.filter((row) => logic.meets(row, set.demands));
    const best = logic.front(inside, byName[set.x], byName[set.y]);
    if (best.length > 1) {
      make("path", svg, { class: "front", d: "M" + best.map((row) => `${px(row.figures[set.x])},${py(row.figures[set.y])}`).join("L") });
    }
    const sorted = [...rows].sort((a, b) => a.figures[set.x] - b.figures[set.x]);
    const apart = (a, b) => Math.abs(px(a.figures[set.x]) - px(b.figures[set.x])) > 17
      || Math.abs(py(a.figures[set.y]) - py(b.figures[set.y])) > 11;
    const points = sorted.map((row, number) => {
      const k = series.indexOf(row.series);
      const out = inside.includes(row) ? "" : " out";
      const g = make("g", svg, {
        class: `point${out}${row.name === set.at ? " chosen" : ""}`, tabindex: 0, role: "button", "data-name": row.name,
        transform: `translate(${px(row.figures[set.x])},${py(row.figures[set.y])})`, "aria-label": tipText(row).join("; "),
      });
      make("path", g, { d: SHAPES[k % SHAPES.length], fill: COLOURS[k % COLOURS.length] });
      make("path", g, { class: "ring", d: "M-8.5,0a8.5,8.5 0 1,0 17,0a8.5,8.5 0 1,0 -17,0" });
      // Of numbers that would cover each other the rightmost is shown.
      if (sorted.slice(number + 1).every((other) => apart(row, other))) make("text", g, { x: 8, y: -5 }, row.word);
      return g;
    });
    points.forEach((g, k) => {
      const row = sorted[k];
      for (const event of ["mouseenter", "focus"]) g.addEventListener(event, () => tip(row, g));
      for (const event of ["mouseleave", "blur"]) g.addEventListener(event, () => { at("tip").hidden = true; });
      g.addEventListener("click", () => choose(row.name));
      g.addEventListener("keydown", (event) => {
        const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
        if (step) { points[(k + step + points.length) % points.length].focus(); event.preventDefault(); }
        if (event.key === "Enter" || event.key === " ") { choose(row.name); event.preventDefault(); }
      });
    });
  }

  function tipText(row) {
    const names = new Set([set.y, set.x, ...set.demands.map((d) => d.name), "cycles", "lut", "dsp", "clock"]);
    const clocks = set.demands.map((d) => [d, logic.needed(row, d)]).filter(([, mhz]) => Number.isFinite(mhz))
      .map(([d, mhz]) => `${d.name} ${d.sign} ${d.limit} takes ${(Math.ceil(10 * mhz) / 10).toFixed(1)} MHz`);
    return [row.name, ...[...names].filter((n) => n in byName).map((n) => `${label(n)} ${withUnit(byName[n], row.figures[n])}`), ...clocks];
  }

  function tip(row, point) {
    const box = at("tip"), where = point.getBoundingClientRect();
    box.replaceChildren();
    tipText(row).forEach((text, k) => make(k ? "div" : "b", box, {}, text));
    box.hidden = false;
    box.style.left = `${Math.min(where.right + 8, innerWidth - 250)}px`;
    box.style.top = `${Math.min(where.bottom + 4, innerHeight - box.offsetHeight - 4)}px`;
  }

  function choose(name) {
    set.at = set.at === name ? null : name;
    draw();
    document.querySelector(`.point[data-name="${CSS.escape(name)}"]`)?.focus();
  }

  function drawDetail() {
    const row = data.rows.find((r) => r.name === set.at), box = at("detail");
    box.hidden = !row;
    box.replaceChildren();
    if (!row) return;
    make("h3", box, {}, row.name);
    if (row.refused) make("p", box, { class: "bad" }, row.refused);
    for (const command of row.commands) {
      const line = make("p", box);
      make("code", line, {}, command);
      const copy = make("button", line, { class: "copy", "aria-label": `copy: ${command}` }, "copy");
      line.insertBefore(document.createTextNode(" "), copy);
      copy.addEventListener("click", () => { navigator.clipboard?.writeText(command); copy.textContent = "copied"; });
    }
    const table = make("table", box);
    for (const q of data.quantities) {
      if (row.figures[q.name] === undefined) continue;
      const tr = make("tr", table);
      make("td", tr, {}, q.title);
      make("td", tr, { class: "r" }, withUnit(q, row.figures[q.name]));
    }
    const outputs = Object.entries(row.latencies).map(([output, cycles]) => `${output} ${cycles}`).join(", ");
    if (outputs) make("p", box, { class: "soft small" }, `cycles to each output: ${outputs}`);
  }

  function drawTable() {
    const own = [set.y, ...set.demands.map((d) => d.name), "tolerance", "cycles", "us", "interval", "lut", "dsp", "ram", "clock", "toggles", "saturated"];
    const names = [...new Set(own)].filter((n) => n in byName);
    const box = at("table");
    box.replaceChildren();
    const table = make("table", box), head = make("tr", make("thead", table)), body = make("tbody", table);
    for (const n of ["combination", ...names]) {
      const q = byName[n], arrow = set.by === n ? " \u2193" : set.by === `-${n}` ? " \u2191" : "";
      const th = make("th", head, q ? { class: "r", title: q.title } : {});
      const sort = make("button", th, {}, label(n) + arrow);
      if (q?.unit && q.unit !== n) make("div", th, { class: "soft" }, q.unit);
      sort.addEventListener("click", () => { set.by = set.by === n ? `-${n}` : n; draw(); });
    }
    const by = set.by?.replace(/^-/, ""), turn = set.by?.startsWith("-") ? -1 : 1;
    const key = (row) => row.figures[by] ?? Infinity;
    const rows = [...data.rows], measured = (row) => names.some((n) => row.figures[n] !== undefined);
    const remarks = rows.some((row) => row.refused && measured(row)); // in a last column
    if (remarks) make("th", head);
    if (by in byName) rows.sort((a, b) => (key(a) === key(b) ? 0 : turn * (key(a) < key(b) ? -1 : 1)));
    else if (turn < 0) rows.reverse();
    for (const row of rows) {
      const out = logic.meets(row, set.demands) ? "" : "out";
      const tr = make("tr", body, { class: `${out}${row.name === set.at ? " chosen" : ""}`, "data-name": row.name });
      tr.addEventListener("click", () => choose(row.name));
      make("td", tr, {}, row.name);
      if (row.refused && !measured(row)) {
        make("td", tr, { colspan: names.length + remarks, class: "bad" }, row.refused);
        continue;
      }
      for (const n of names) make("td", tr, { class: "r" }, logic.text(row.figures[n]));
      if (remarks) make("td", tr, row.refused ? { class: "bad" } : {}, row.refused || "");
    }
  }

  function draw() {
    for (const id of ["x", "y"]) { at(id).value = set[id]; at(`log${id}`).checked = set[`log${id}`]; }
    const logs = [set.logx, set.logy], rows = logic.shown(data.rows, set.x, set.y, logs);
    at("plots").replaceChildren();
    at("tip").hidden = true;
    if (rows.length) {
      const xs = logic.axis(rows.map((row) => row.figures[set.x]), set.logx);
      const ys = logic.axis(rows.map((row) => row.figures[set.y]), set.logy);
      for (const target of targets) plot(target, rows.filter((row) => row.target === target), xs, ys);
    }
    const hidden = data.rows.length - rows.length, inside = rows.filter((row) => logic.meets(row, set.demands)).length;
    const keys = at("keys");
    keys.replaceChildren();
    series.forEach((name, k) => {
      const key = make("span", keys, { class: "key" });
      const svg = make("svg", key, { width: 14, height: 14, viewBox: "-7 -7 14 14", style: "display:inline-block;width:14px;vertical-align:-2px;margin-right:5px" });
      make("path", svg, { d: SHAPES[k % SHAPES.length], fill: COLOURS[k % COLOURS.length] });
      key.append(name);
    });
    make("span", keys, { class: "soft" }, `numbers: word width, bits; ${inside} of ${data.rows.length} meet the demands${hidden ? `; ${hidden} without these figures` : ""}`);
    drawDetail();
    drawTable();
    history.replaceState(null, "", logic.address(set));
  }

  drawDemands();
  draw();
  if (data.left) {
    setInterval(() => { if (!["INPUT", "SELECT"].includes(document.activeElement?.tagName)) location.reload(); }, 4000);
  }
}

if (typeof module !== "undefined") module.exports = logic;
if (typeof document !== "undefined") start();
