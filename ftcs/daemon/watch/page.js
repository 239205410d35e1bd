"use strict";
// Each daemon of this host is a section with a ring of points; nothing grows with time.
const kPoints = 6000;
const kRetry_ms = 3000;
const kColumns = 6;  // time s, offset ns, sigma ns, rate ppb, delay ns, used
const kModes = { locked: "locked", acquiring: "acquiring", holdover: "holdover", freerun: "free run" };
const kAlStates = { 1: "INIT", 2: "PREOP", 3: "BOOT", 4: "SAFEOP", 8: "OP" };
const daemons = new Map();
const byId = (id) => document.getElementById(id);
const color = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();

function nanoseconds(value) {
  if (value === null || !isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size >= 1e9) return (value / 1e9).toPrecision(4) + " s";
  if (size >= 1e6) return (value / 1e6).toPrecision(4) + " ms";
  if (size >= 1e3) return (value / 1e3).toPrecision(4) + " µs";
  if (size < 0.005) return "0.00 ns";  // and not -0.00
  return value.toFixed(size < 10 ? 2 : 1) + " ns";
}
function duration(seconds) {
  if (seconds < 120) return (Number.isInteger(seconds) ? seconds : seconds.toFixed(1)) + " s";
  return seconds < 7200 ? (seconds / 60).toFixed(0) + " min" : (seconds / 3600).toFixed(1) + " h";
}

class Ring {
  constructor() { this.values = new Float64Array(kPoints * kColumns); this.next = 0; this.size = 0; }
  add(point) {
    if (this.size > 0 && point[0] <= this.at(this.size - 1, 0)) return;  // told again after a pause
    for (let i = 0; i < kColumns; ++i) this.values[this.next * kColumns + i] = point[i] === null ? NaN : point[i];
    this.next = (this.next + 1) % kPoints;
    this.size = Math.min(this.size + 1, kPoints);
  }
  clear() { this.next = this.size = 0; }
  at(i, column) { return this.values[((this.next - this.size + i + kPoints) % kPoints) * kColumns + column]; }
}

// A canvas with axes; x and y are maps from a value to a pixel.
class Plot {
  constructor(canvas) { this.canvas = canvas; }
  begin(x, y, format) {
    const scale = window.devicePixelRatio || 1;
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (this.canvas.width !== Math.round(width * scale) || this.canvas.height !== Math.round(height * scale)) {
      this.canvas.width = Math.round(width * scale);
      this.canvas.height = Math.round(height * scale);
    }
    const c = this.context = this.canvas.getContext("2d");
    c.setTransform(scale, 0, 0, scale, 0, 0);
    c.clearRect(0, 0, width, height);
    c.font = "11px system-ui, sans-serif";
    const labels = ticks(y, 5).map((tick) => c.measureText(format.y(tick)).width);
    const left = Math.ceil(Math.max(52, ...labels)) + 10, right = width - 6, top = 6, bottom = height - 18;
    const along = (axis, from, to) => (value) => {
      const v = axis.log ? Math.log10(Math.max(value, 1e-300)) : value;
      const low = axis.log ? Math.log10(axis.low) : axis.low, high = axis.log ? Math.log10(axis.high) : axis.high;
      return from + (to - from) * (v - low) / (high - low);
    };
    this.x = along(x, left, right);
    this.y = along(y, bottom, top);
    c.fillStyle = color("faint");
    c.strokeStyle = color("line");
    c.lineWidth = 1;
    c.textAlign = "right"; c.textBaseline = "middle";
    for (const tick of ticks(y, 5)) {
      const at = this.y(tick);
      c.beginPath(); c.moveTo(left, at); c.lineTo(right, at); c.stroke();
      c.fillText(format.y(tick), left - 4, at);
    }
    c.textBaseline = "top";
    for (const tick of ticks(x, Math.max(2, Math.floor(width / 110)))) {
      c.textAlign = this.x(tick) > right - 20 ? "right" : "center";
      c.fillText(format.x(tick), this.x(tick), bottom + 4);
    }
    c.save(); c.beginPath(); c.rect(left, top, right - left, bottom - top); c.clip();
    return c;
  }
  end() { this.context.restore(); }
}
function ticks(axis, about) {
  const found = [];
  if (axis.log) {
    const low = Math.ceil(Math.log10(axis.low)), high = Math.floor(Math.log10(axis.high));
    const step = Math.max(1, Math.ceil((high - low + 1) / about));
    for (let e = low; e <= high; e += step) found.push(10 ** e);
    return found;
  }
  const rough = (axis.high - axis.low) / about;
  const unit = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((n) => n * unit).find((n) => n >= rough);
  for (let v = Math.ceil(axis.low / step) * step; v <= axis.high + step * 1e-9; v += step) found.push(Math.abs(v) < step * 1e-9 ? 0 : Number(v.toPrecision(12)));
  return found;
}
function padded(low, high) {
  if (!(low <= high)) return { low: -1, high: 1 };
  const space = (high - low) * 0.08 || Math.abs(high) * 0.1 || 1;
  return { low: low - space, high: high + space };
}
// Of sorted values all but the farthest hundredth: a start does not squeeze the rest.
function robust(values) {
  if (values.length === 0) return { low: NaN, high: NaN };
  const sorted = Float64Array.from(values).sort(), cut = sorted.length < 20 ? 0 : Math.ceil(sorted.length / 100);
  return { low: sorted[cut], high: sorted[sorted.length - 1 - cut] };
}

class Daemon {
  constructor(origin) {
    this.ring = new Ring();
    this.state = null;
    this.drawn = null;
    this.section = byId("daemon").content.firstElementChild.cloneNode(true);
    this.plots = {};
    for (const canvas of this.section.querySelectorAll("canvas")) this.plots[canvas.className] = new Plot(canvas);
    byId("daemons").append(this.section);
    this.connect(origin);
  }
  connect(origin) {
    this.source = new EventSource(origin + "/events");
    this.source.addEventListener("state", (event) => this.tell(JSON.parse(event.data)));
    this.source.addEventListener("points", (event) => {
      for (const point of JSON.parse(event.data)) this.ring.add(point);
      this.dirty = true;
    });
    this.source.onopen = () => { this.ring.clear(); };
    this.source.onerror = () => {
      this.lost();
      // A refusal, as of one listener too many, is final to a browser; what slept wakes up to it.
      if (this.source.readyState === EventSource.CLOSED) setTimeout(() => this.connect(origin), kRetry_ms);
    };
  }
  lost() {
    this.part(".dot").className = "dot";
    this.section.dataset.mode = "lost";
    this.part(".sentence").textContent = "this daemon does not answer (it has ended, or too many pages are open); trying again";
  }
  part(selector) { return this.section.querySelector(selector); }
  tell(state) {
    if (!state.program) return;
    this.state = state;
    this.dirty = true;
    this.section.dataset.mode = state.mode;
    this.part(".dot").className = "dot " + state.mode;
    this.part(".title").textContent = `${state.kind} ${state.target}: ${kModes[state.mode]}`;
    this.part(".sentence").textContent = state.sentence;
    const refused = state.refused.outlier + state.refused.duplicate + state.refused.implausible;
    const figures = [["offset", nanoseconds(state.offset_ns)], ["three sigma", nanoseconds(state.sigma_ns === null ? null : 3 * state.sigma_ns)],
      ["cannot be more than", nanoseconds(state.bound_ns)], ["path delay", nanoseconds(state.delay_ns)],
      ["rate", state.rate_ppb === null ? "–" : (state.rate_ppb / 1000).toFixed(3) + " ppm"],
      ["used", state.used], ["refused", refused === 0 ? "0" : `${refused} (${state.refused.outlier} outliers)`], ["steps", state.steps],
      ["servo", state.servo], ["reference", state.reference || "–"], ["running for", duration(Math.round(state.uptime_s))]];
    if (state.cycle) {
      figures.push(["working counter", `${state.cycle.working_counter} of ${state.cycle.expected_counter}`],
        ["margin", nanoseconds(state.cycle.margin_ns)], ["lost, late", `${state.cycle.lost}, ${state.cycle.late}`],
        ["drives", [...new Set(state.cycle.drives.map((d) => kAlStates[d[0] & 15] || "?"))].join(", ") || "–"]);
    }
    const list = this.part(".figures");
    while (list.children.length > figures.length) list.lastElementChild.remove();
    figures.forEach(([name, value], i) => {
      let entry = list.children[i];
      if (!entry) {
        entry = document.createElement("div");
        entry.append(document.createElement("dt"), document.createElement("dd"));
        list.append(entry);
      }
      entry.firstElementChild.textContent = name;
      entry.lastElementChild.textContent = value;
    });
    this.part(".margins").hidden = !state.cycle || state.cycle.drives.length === 0;
  }
  draw() {
    if (!this.dirty || !this.section.isConnected) return;
    this.dirty = false;
    const ring = this.ring, span = Number(byId("span").value);
    let first = 0;
    const end = ring.size > 0 ? ring.at(ring.size - 1, 0) : 1;
    if (span > 0) while (first < ring.size && ring.at(first, 0) < end - span) ++first;
    const begin = first < ring.size ? ring.at(first, 0) : 0;
    const time = { low: begin, high: Math.max(end, begin + 1) };
    this.offsets(first, time);
    this.line("rate", 3, first, time, (v) => (v / 1000).toFixed(Math.abs(v) >= 1e6 ? 0 : 2) + " ppm");
    this.line("delay", 4, first, time, nanoseconds);
    if (this.state) { this.histogram(); this.stability(); this.drives(); }
    this.section.dataset.points = ring.size;
  }
  offsets(first, time) {
    const ring = this.ring, log = byId("log").checked, values = [];
    for (let i = first; i < ring.size; ++i) {
      const offset = ring.at(i, 1), sigma = ring.at(i, 2);
      if (!isFinite(offset)) continue;
      if (log) values.push(Math.max(Math.abs(offset), 0.1));
      else if (isFinite(sigma)) values.push(offset - 3 * sigma, offset + 3 * sigma);
      else values.push(offset);
    }
    let range = robust(values);
    if (log) {
      const low = values.length ? Math.min(...values) : 0.1, high = values.length ? Math.max(...values) : 1;
      range = { low: 10 ** Math.floor(Math.log10(low)), high: 10 ** Math.ceil(Math.log10(high * 1.01)), log: true };
    } else range = padded(range.low, range.high);
    const plot = this.plots.offset, c = plot.begin(time, range, { x: duration, y: nanoseconds });
    const edge = (sign, i) => {
      const offset = ring.at(i, 1), sigma = ring.at(i, 2);
      const value = (log ? Math.abs(offset) : offset) + sign * 3 * (isFinite(sigma) ? sigma : 0);
      return plot.y(log ? Math.max(value, range.low) : value);
    };
    c.fillStyle = color("band");
    c.beginPath();
    for (let i = first; i < ring.size; ++i) c.lineTo(plot.x(ring.at(i, 0)), edge(1, i));
    for (let i = ring.size - 1; i >= first; --i) c.lineTo(plot.x(ring.at(i, 0)), edge(-1, i));
    c.fill();
    c.strokeStyle = color("blue"); c.fillStyle = color("bad"); c.lineWidth = 1.2;
    c.beginPath();
    for (let i = first; i < ring.size; ++i) {
      const y = plot.y(log ? Math.max(Math.abs(ring.at(i, 1)), range.low) : ring.at(i, 1)), x = plot.x(ring.at(i, 0));
      if (ring.at(i, 5)) c.lineTo(x, y); else c.fillRect(x - 2, y - 2, 4, 4);
    }
    c.stroke();
    plot.end();
  }
  line(name, column, first, time, format) {
    const ring = this.ring, values = [];
    for (let i = first; i < ring.size; ++i) if (isFinite(ring.at(i, column))) values.push(ring.at(i, column));
    const range = robust(values), plot = this.plots[name];
    const c = plot.begin(time, padded(range.low, range.high), { x: duration, y: format });
    c.strokeStyle = color("blue");
    c.beginPath();
    for (let i = first; i < ring.size; ++i) if (isFinite(ring.at(i, column))) c.lineTo(plot.x(ring.at(i, 0)), plot.y(ring.at(i, column)));
    c.stroke();
    plot.end();
  }
  histogram() {
    const { lowest_ns: low, width_ns: width, counts } = this.state.histogram, plot = this.plots.histogram;
    if (counts.length === 0) return;
    const c = plot.begin({ low, high: low + width * counts.length }, { low: 0, high: Math.max(...counts) * 1.05 },
      { x: nanoseconds, y: (v) => String(Math.round(v)) });
    c.fillStyle = color("blue");
    counts.forEach((count, i) => c.fillRect(plot.x(low + i * width), plot.y(count), Math.max(plot.x(low + width) - plot.x(low) - 1, 1), plot.y(0) - plot.y(count)));
    plot.end();
  }
  stability() {
    const curves = [this.state.adev, this.state.tdev].map((curve) => curve.filter((p) => p[0] > 0 && p[1] > 0));
    const all = curves.flat();
    if (all.length === 0) return;
    const range = (i) => ({ low: 10 ** Math.floor(Math.log10(Math.min(...all.map((p) => p[i])))), high: 10 ** Math.ceil(Math.log10(Math.max(...all.map((p) => p[i])) * 1.001)), log: true });
    const plot = this.plots.stability, c = plot.begin(range(0), range(1), { x: (v) => v.toPrecision(1) * 1 + " s", y: (v) => v.toExponential(0) });
    curves.forEach((curve, i) => {
      c.strokeStyle = c.fillStyle = color(i === 0 ? "orange" : "blue");
      c.beginPath();
      for (const [tau, deviation] of curve) { c.lineTo(plot.x(tau), plot.y(deviation)); }
      c.stroke();
      for (const [tau, deviation] of curve) c.fillRect(plot.x(tau) - 2, plot.y(deviation) - 2, 4, 4);
      c.textAlign = "left"; c.textBaseline = "top";
      c.fillText(i === 0 ? "ADEV" : "TDEV, s", plot.canvas.clientWidth - 62, 10 + 14 * i);
    });
    plot.end();
  }
  drives() {
    if (!this.state.cycle || this.state.cycle.drives.length === 0) return;
    const drives = this.state.cycle.drives, plot = this.plots.drives;
    const c = plot.begin({ low: -0.5, high: drives.length - 0.5 }, { low: 0, high: Math.max(...drives.map((d) => d[1]), 1) * 1.1 },
      { x: (v) => (Number.isInteger(v) ? "drive " + v : ""), y: (v) => nanoseconds(v * 1000) });
    drives.forEach(([state, margin], i) => {
      c.fillStyle = color((state & 15) === 8 ? "good" : "wait");
      const half = Math.min(14, (plot.x(1) - plot.x(0)) * 0.4);
      c.fillRect(plot.x(i) - half, plot.y(margin), 2 * half, plot.y(0) - plot.y(margin));
    });
    plot.end();
  }
}

function watch(origin) { if (!daemons.has(origin)) daemons.set(origin, new Daemon(origin)); }
async function findOthers() {
  try {
    const ports = await (await fetch("others")).json();
    for (const port of ports) watch(`${location.protocol}//${location.hostname}:${port}`);
  } catch (error) { /* this daemon has ended: its section says so */ }
}
function redraw() { for (const daemon of daemons.values()) daemon.dirty = true; }
for (const id of ["log", "span"]) byId(id).addEventListener("change", redraw);
window.addEventListener("resize", redraw);
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
watch(location.origin);
findOthers();
setInterval(findOthers, 10000);
setInterval(() => { if (!document.hidden) for (const daemon of daemons.values()) daemon.draw(); }, 200);
