// The page put together: a full-screen picture that follows the eye, and beside it what that costs.

import { Stage } from "./canvas.js";
import { Dial } from "./dial.js";
import { PointerGaze } from "./gaze.js";
import { Keys } from "./keys.js";
import { askToken, Notices } from "./notices.js";
import { Orbit } from "./orbit.js";
import { legendOf, Overlays } from "./overlays.js";
import { Panel } from "./panel.js";
import { ScenePicker } from "./scenes.js";
import { CardFitting, ScreenSize } from "./screen.js";
import { Service, Token } from "./service.js";
import { Settings } from "./settings.js";
import { Stream } from "./stream.js";
import { Targets } from "./targets.js";

const SESSION_KEY = "gazetrace-stream";
const CENTRE = { x: 0.5, y: 0.5 };
const NARROW = "(max-width: 720px)"; // as in page.css

const element = (id) => document.getElementById(id);
const view = element("view");

const notices = new Notices();
const panel = new Panel((name) => settings.toggleEffect(name));
const token = new Token(askToken);
const service = new Service(token);
const screen = new ScreenSize();
const settings = new Settings({ form: element("settings"), onChange: changed });
const dial = new Dial({
  service,
  onPick: (setting) => (setting ? settings.turnTo(setting) : dial.follow(settings.quality)),
  onError: refuse,
});
const orbit = new Orbit({ view, onTurn: want });
const stage = new Stage({ view, stage: element("stage"), frame: element("frame"), onResize: want });
const stream = new Stream({
  token,
  session: new URLSearchParams(location.search).get("session") ?? sessionStorage.getItem(SESSION_KEY),
  on: {
    state: connectionChanged,
    ready,
    status: tellStatus,
    target: (message) => targets.show(message, display),
    error: refuse,
    clock: (trip) => panel.clock(trip),
    frame: show,
  },
});
const gaze = new PointerGaze({
  view,
  toDisplay: (x, y) => stage.toDisplay(x, y),
  look: (fields) => stream.look(fields),
  busy: () => orbit.turning,
});
const targets = new Targets({ layer: element("target"), toWindow: (share) => stage.toWindow(share) });
const overlays = new Overlays({
  marks: element("marks"),
  drawn: element("drawn"),
  cells: (query) => service.cells(query),
  onError: refuse,
  on: { gaze: true },
});
const fitting = new CardFitting({ dialog: element("fitting"), screen, onKept: changed });
const picker = new ScenePicker({
  popover: element("scenes"),
  label: element("scene_name"),
  service,
  onPick: (id) => { location.hash = id; },
});

let scene = null;
let display = null; // of the configuration in force, complete
let quality = null;
let sources = 0; // of gaze, besides this page

/** State to the service what this page wants to see. */
function want() {
  element("reset_view").disabled = !orbit.moved;
  if (!scene || !stage.measured || !(settings.distanceCm > 0)) return;
  const size = stage.displaySize(settings.size);
  const pitchCm = screen.pitchCm(stage.ratio) * stage.scaleOf(size);
  quality = settings.quality;
  dial.follow(quality);
  tellScreen(size, pitchCm);
  stream.want({
    scene,
    display: {
      ...size,
      width_cm: size.width_px * pitchCm,
      height_cm: size.height_px * pitchCm,
      distance_cm: settings.distanceCm,
    },
    camera: orbit.camera,
    quality,
    ...settings.encoding,
  });
}

function changed(control) {
  if (control === "distance_cm") screen.keep({ distance_cm: settings.distanceCm });
  if (control === "source") followSource();
  settings.blame(null);
  want();
}

function followSource() {
  gaze.on = !settings.tracked;
  document.body.classList.toggle("tracked", settings.tracked);
  element("hold").disabled = settings.tracked;
  notices.status(gazeTold("none"));
  if (settings.tracked) stream.lookAway();
  else gaze.lookAt(CENTRE);
}

function connectionChanged(state) {
  notices.connection(state);
  if (state.name === "lost") panel.forget();
  if (state.name === "locked") notices.settle();
}

function ready(message, own) {
  sessionStorage.setItem(SESSION_KEY, message.session);
  element("session").value = message.session;
  notices.connection({ name: "live" });
  if (message.config === null) return;
  notices.settle();
  settings.blame(null);
  display = message.display;
  stage.display = display;
  if (own) orbit.home ??= message.camera;
  panel.configured(message, quality);
  picker.describe(message.scene);
}

function refuse({ message, field }) {
  notices.problem(message);
  notices.status("");
  settings.blame(field);
}

function tellStatus({ viewers, gaze_sources, gaze_state }) {
  sources = gaze_sources;
  element("viewers").textContent = viewers;
  element("sources").textContent = gaze_sources;
  element("gaze_state").textContent = gaze_state;
  const told = gazeTold(gaze_state);
  if (told) notices.status(told);
}

/** What is worth saying of the gaze; empty: nothing. */
function gazeTold(state) {
  if (settings.tracked && sources === 0) return "Waiting for a tracker: give the session's name to its bridge.";
  return state === "lost" ? "The gaze is lost: the whole screen is rendered evenly." : "";
}

function show({ header, picture }) {
  notices.status(gazeTold(header.gaze_state));
  stage.show(picture);
  panel.frame(header, header.gaze && gaze.seenAt(header.gaze));
  overlays.show({ gaze: header.gaze, display, query: cellQuery(header), pixelRatio: stage.ratio });
}

function cellQuery(header) {
  return header.gaze && {
    gaze_x: header.gaze.x,
    gaze_y: header.gaze.y,
    ...display,
    map: header.map.kind,
    gaze_bucket_px: header.map.bucket_px,
    samples_per_cell: Math.max(1, Math.round(header.samples)),
    acuity_model: quality.acuity.model,
    acuity_scale: header.acuity_scale,
    margin_deg: header.map.margin_deg,
  };
}

function tellScreen(size, pitchCm) {
  const [width, height] = [size.width_px, size.height_px].map((side) => (side * pitchCm).toFixed(1));
  const perDegree = (settings.distanceCm * Math.tan(Math.PI / 180)) / pitchCm;
  const how = screen.calibrated ? "measured" : "assumed from 96 pixels to the inch";
  element("screen_told").textContent =
    `${size.width_px} × ${size.height_px} px, ${width} × ${height} cm, ${how}; ${perDegree.toFixed(0)} px a degree.`;
}

function chooseScene() {
  scene = decodeURIComponent(location.hash.slice(1)) || scene;
  orbit.home = null;
  dial.forScene(scene);
  picker.choose(scene);
  notices.status(`Loading ${scene} …`);
  want();
}

function toggleOverlay(name) {
  overlays.toggle(name);
  const on = overlays.on;
  for (const button of document.querySelectorAll("[data-overlay]")) {
    button.setAttribute("aria-pressed", Boolean(on[button.dataset.overlay]));
  }
  const legend = legendOf(on.cells ? "cells" : on.rays ? "rays" : "");
  element("legend").hidden = !legend;
  if (!legend) return;
  element("legend_title").textContent = legend.title;
  element("legend_steps").replaceChildren(...legend.steps.map(([label, colour]) => {
    const step = document.createElement("li");
    const sample = document.createElement("i");
    if (colour) sample.style.background = colour;
    step.append(sample, label);
    return step;
  }));
}

function toggleHold() {
  if (settings.tracked) return;
  gaze.held = !gaze.held;
  element("hold").setAttribute("aria-pressed", gaze.held);
}

function togglePanel() {
  const hidden = document.body.classList.toggle("bare");
  element("panel_toggle").setAttribute("aria-pressed", !hidden);
}

function toggleFullScreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen();
}

async function copySession() {
  element("session").select();
  await navigator.clipboard?.writeText(element("session").value);
}

const help = () => element("help").showModal();
const keys = new Keys([
  { keys: ["?"], does: "this sheet", run: help },
  { keys: ["s"], does: "choose a scene", run: () => element("scenes").togglePopover() },
  { keys: ["p"], does: "show or hide the panel", run: togglePanel },
  { keys: ["f"], does: "full screen", run: toggleFullScreen },
  { keys: [" "], shown: "Space", does: "hold the gaze, free the pointer", run: toggleHold },
  { keys: ["t"], does: "gaze from a tracker, or from the pointer", run: () => { settings.tracked = !settings.tracked; } },
  { keys: ["g"], does: "draw the gaze", run: () => toggleOverlay("gaze") },
  { keys: ["r"], does: "draw 2.5, 5 and 10 degrees around it", run: () => toggleOverlay("region") },
  { keys: ["c"], does: "draw the cells", run: () => toggleOverlay("cells") },
  { keys: ["d"], does: "draw the density of rays", run: () => toggleOverlay("rays") },
  { keys: ["[", "]"], shown: "[  ]", does: "half, twice the samples", run: (key) => settings.stepSamples(key === "]") },
  { keys: ["ArrowLeft"], shown: "← →", does: "turn the camera", run: () => orbit.step(-1, 0) },
  { keys: ["ArrowRight"], run: () => orbit.step(1, 0) },
  { keys: ["ArrowUp"], shown: "↑ ↓", does: "raise, lower the camera", run: () => orbit.step(0, 1) },
  { keys: ["ArrowDown"], run: () => orbit.step(0, -1) },
  { keys: ["+", "=", "-"], shown: "+  −", does: "nearer, farther", run: (key) => orbit.near(key === "-" ? -1 : 1) },
  { keys: ["0"], does: "the scene's own view", run: () => orbit.reset() },
  { keys: ["Escape"], shown: "Esc", does: "close what is open", run: () => targets.hide() },
]);
keys.list(element("help_keys"));

for (const button of document.querySelectorAll("[data-overlay]")) {
  button.addEventListener("click", () => toggleOverlay(button.dataset.overlay));
}
for (const [id, run] of Object.entries({
  hold: toggleHold,
  reset_view: () => orbit.reset(),
  full_screen: toggleFullScreen,
  help_open: help,
  panel_toggle: togglePanel,
  calibrate: () => fitting.open(),
  copy: copySession,
  connection: () => stream.hurry(),
})) element(id).addEventListener("click", run);
addEventListener("hashchange", chooseScene);

if (matchMedia(NARROW).matches) togglePanel();
settings.distanceCm = screen.distanceCm;
settings.offer(await service.qualitySchema());
[scene] = await picker.load();
gaze.lookAt(CENTRE);
chooseScene();
stream.start();
