// The panel's figures: what the frames cost, how accurate they are, how fast they come.

import { AccuracyPlot } from "./plot.js";
import { ClockOffset, FrameRate, Latencies } from "./statistics.js";

const STAGES = ["wait", "map", "trace", "reconstruct", "encode"];
const RAY_KINDS = ["primary", "shadow", "reflection", "refraction"];
const PHASES = { moving: "gaze moves", still: "refining", final: "complete" };
const NS_PER_MS = 1e6;
const REFRESH_MS = 250;
const COARSER = 1.01; // factor on the width of cells that is worth telling

const element = (id) => document.getElementById(id);

/** Figures of the frames as they come. */
export class Panel {
  #plot = new AccuracyPlot(element("plot"));
  #rate = new FrameRate();
  #latencies = new Latencies();
  #clock = new ClockOffset();
  #lineStart = 0;
  #config = null;
  #lastSeen = 0;
  #asked = null;
  #onEffect;

  /** @param onEffect receives the name of an effect that is to be simulated, or not any more */
  constructor(onEffect) {
    this.#onEffect = onEffect;
    setInterval(() => write("rate", this.#rate.rate(performance.now())), REFRESH_MS);
    for (const tab of element("tabs").children) tab.addEventListener("click", () => selectTab(tab));
    element("tabs").addEventListener("keydown", moveBetweenTabs);
  }

  /** A connection was lost: its clock and its latencies say nothing about the next one. */
  forget() {
    this.#clock.clear();
    this.#latencies.clear();
  }

  /** A round trip of a ping. */
  clock(trip) {
    this.#clock.add(trip);
    write("round_trip", `${trip.roundTripMs.toFixed(1)} ms`);
  }

  /** What is in force: its effects, and the quality that was asked for. */
  configured({ effects }, quality) {
    this.#asked = quality;
    const items = effects.map(({ name, reason }) => this.#effect(name, reason));
    if (!items.length) {
      items.push(document.createElement("li"));
      items[0].className = "none";
      items[0].textContent = "none: this scene calls for no effect";
    }
    element("effects").replaceChildren(...items);
  }

  #effect(name, reason) {
    const item = document.createElement("li");
    const button = document.createElement("button");
    const called = name.replaceAll("_", " ");
    button.textContent = called;
    button.dataset.effect = name;
    button.title = `simulate ${called}, or leave it out`;
    button.setAttribute("aria-pressed", !this.#asked.effects.includes(`-${name}`));
    button.addEventListener("click", () => this.#onEffect(name));
    item.append(button, ` ${reason}`);
    item.title = reason;
    return item;
  }

  /**
   * A frame that was just drawn.
   *
   * @param header its header
   * @param seenAt when this page's own gaze was there, by performance.now(); null for another's gaze
   */
  frame(header, seenAt) {
    const now = performance.now();
    this.#rate.count(now);
    write("rate", this.#rate.rate(now));
    this.#noteLatency(header, seenAt, now);
    this.#plotError(header);
    tellCost(header, this.#asked);
  }

  #noteLatency({ gaze, service_time_ns }, seenAt, now) {
    if (!gaze || service_time_ns.gaze_received === this.#lastSeen) return;
    this.#lastSeen = service_time_ns.gaze_received;
    const offset = this.#clock.best?.offsetNs;
    if (seenAt === null && (gaze.seq == null || offset === undefined)) return;
    const began = seenAt ?? (service_time_ns.gaze_received - offset) / NS_PER_MS;
    this.#latencies.add(now - began);
    write("latency_50", this.#latencies.percentile(0.5).toFixed(0));
    write("latency_95", this.#latencies.percentile(0.95).toFixed(0));
    const from = seenAt === null ? "gaze received" : "pointer moved";
    write("latency_note", `${from} to frame drawn, last ${plural(this.#latencies.count, "gaze")}`);
  }

  #plotError({ config, phase, error, service_time_ns }) {
    const fresh = phase === "moving" || config !== this.#config;
    if (fresh) this.#lineStart = config === this.#config ? service_time_ns.gaze_received : service_time_ns.started;
    this.#config = config;
    const timeMs = (service_time_ns.finished - this.#lineStart) / NS_PER_MS;
    this.#plot.add({ fresh, timeMs, rms: error.rms, foveal: error.foveal_rms });
  }
}

function tellCost(header, asked) {
  const { width, height, map, rays, timing_ms, error } = header;
  const pixels = width * height;
  const allRays = RAY_KINDS.reduce((sum, kind) => sum + rays[kind], 0);
  write("phase", PHASES[header.phase] ?? header.phase);
  element("phase").dataset.phase = header.phase;
  write("size", `${width} × ${height}`);
  write("cells", count(map.cells));
  write("cells_share", `${percent(map.cells / pixels)} of px`);
  write("traced", count(header.cells_traced));
  write("traced_share", percent(header.cells_traced / map.cells));
  write("reused", count(header.cells_reused));
  write("reused_share", percent(header.cells_reused / map.cells));
  write("samples_now", header.samples.toFixed(1));
  write("samples_asked", samplesAsked(header, asked));
  write("rays", count(allRays));
  write("rays_per_pixel", `${(allRays / pixels).toFixed(2)} a pixel`);
  for (const kind of RAY_KINDS) {
    write(kind, count(rays[kind]));
    write(`${kind}_share`, allRays ? percent(rays[kind] / allRays) : "");
  }
  write("superseded", count(header.superseded));
  write("dropped", count(header.dropped));
  write("rms", accuracy(error.rms));
  write("foveal_rms", accuracy(error.foveal_rms));
  write("total", `${timing_ms.total.toFixed(1)} ms${header.deadline_met === false ? ", past its deadline" : ""}`);
  element("total").classList.toggle("late", header.deadline_met === false);
  for (const stage of STAGES) {
    write(stage, `${timing_ms[stage].toFixed(1)} ms`);
    document.querySelector(`#stages .${stage}`).style.flexGrow = timing_ms[stage];
  }
}

/** How far the samples have come, or how much coarser than asked for the cells had to be. */
function samplesAsked({ acuity_scale }, { samples_per_cell, acuity }) {
  const coarser = acuity_scale / acuity.scale;
  return coarser > COARSER ? `cells × ${coarser.toFixed(1)}` : `of ${samples_per_cell}`;
}

function selectTab(selected) {
  for (const tab of element("tabs").children) {
    const chosen = tab === selected;
    tab.setAttribute("aria-selected", chosen);
    tab.tabIndex = chosen ? 0 : -1;
    element(tab.getAttribute("aria-controls")).hidden = !chosen;
  }
}

function moveBetweenTabs(event) {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step) return;
  const tabs = [...event.currentTarget.children];
  const next = tabs.at((tabs.indexOf(document.activeElement) + step) % tabs.length);
  selectTab(next);
  next.focus();
  event.stopPropagation();
}

function write(id, text) {
  element(id).textContent = text;
}

function count(number) {
  return number.toLocaleString("en");
}

function plural(number, noun) {
  return `${number} ${noun}${number === 1 ? "" : "s"}`;
}

function percent(share) {
  return `${(100 * share).toFixed(1)} %`;
}

function accuracy(error) {
  return error === null ? "–" : error.toPrecision(2);
}
