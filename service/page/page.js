// The page: the mouse over the picture is the gaze; what it costs is beside it.

import { FrameSource, NotNow } from "./frame_source.js";

const CM_PER_CSS_PX = 2.54 / 96;
const STAGES = ["wait", "map", "trace", "reconstruct", "encode"];
const RAY_KINDS = ["primary", "shadow", "reflection", "refraction"];

const element = (id) => document.getElementById(id);
const controls = element("controls");
const view = element("view");
const source = new FrameSource({ onFrame: show, onError: report, askToken });

let size = null; // of the view: device pixels and CSS pixels
let gaze = null; // as shares of the view, so that it survives a change of size
let askedToken = null;

function order() {
  const field = (name) => controls.elements[name].value;
  return {
    scene: field("scene"),
    gaze: { x: gaze.x * size.width_px, y: gaze.y * size.height_px },
    display: {
      width_px: size.width_px,
      height_px: size.height_px,
      width_cm: size.width_css * CM_PER_CSS_PX,
      height_cm: size.height_css * CM_PER_CSS_PX,
      distance_cm: Number(field("distance_cm")),
    },
    quality: {
      map: field("map"),
      samples_per_cell: Number(field("samples")),
      acuity: { scale: cellScale() },
    },
    format: field("format"),
    show_cells: controls.elements.show_cells.checked,
  };
}

function ask() {
  if (size && gaze && controls.elements.scene.value && controls.reportValidity()) source.ask(order());
}

function show({ picture, cells, header, roundTripMs }) {
  element("banner").hidden = true;
  element("status").textContent = "";
  paint(element("frame"), picture);
  element("cells").hidden = !cells;
  if (cells) paint(element("cells"), cells);
  const pixelCss = size.width_css / size.width_px;
  element("gaze").hidden = false;
  element("gaze").style.transform = `translate(${header.gaze.x * pixelCss}px, ${header.gaze.y * pixelCss}px)`;
  tell(header, roundTripMs);
}

function paint(canvas, picture) {
  canvas.width = picture.width;
  canvas.height = picture.height;
  canvas.style.width = `${(picture.width * size.width_css) / size.width_px}px`;
  canvas.style.height = `${(picture.height * size.height_css) / size.height_px}px`;
  canvas.getContext("2d").drawImage(picture, 0, 0);
  picture.close();
}

function tell(header, roundTripMs) {
  const pixels = header.width * header.height;
  const rays = RAY_KINDS.reduce((sum, kind) => sum + header.rays[kind], 0);
  write("number", header.frame);
  write("size", `${header.width} × ${header.height}`);
  write("gaze_shown", `${Math.round(header.gaze.x)}, ${Math.round(header.gaze.y)}`);
  write("cell_count", count(header.map.cells));
  write("cell_share", `${percent(header.map.cells / pixels)} of px`);
  write("reused", count(header.cells_reused));
  write("reused_share", percent(header.cells_reused / header.map.cells));
  write("rays", count(rays));
  write("rays_per_pixel", `${(rays / pixels).toFixed(2)} a px`);
  for (const kind of RAY_KINDS) write(kind, count(header.rays[kind]));
  write("rms", accuracy(header.error.rms));
  write("foveal_rms", accuracy(header.error.foveal_rms));
  write("total", header.timing_ms.total.toFixed(1));
  for (const stage of STAGES) {
    write(stage, header.timing_ms[stage].toFixed(1));
    document.querySelector(`#bar .${stage}`).style.flexGrow = header.timing_ms[stage];
  }
  write("round_trip", roundTripMs.toFixed(1));
  write("effects", header.effects.length ? `Simulates ${header.effects.join(", ")}` : "Calls for no effect");
}

function report(error) {
  if (error instanceof NotNow) {
    element("status").textContent = error.message;
  } else {
    element("banner").textContent = error.message;
    element("banner").hidden = false;
  }
}

function askToken(why) {
  askedToken ??= new Promise((resolve) => {
    const dialog = element("token");
    const field = dialog.querySelector("input");
    write("token_why", why);
    field.value = "";
    dialog.addEventListener("close", () => {
      askedToken = null;
      resolve(field.value);
    }, { once: true });
    dialog.addEventListener("cancel", (event) => event.preventDefault());
    dialog.showModal();
  });
  return askedToken;
}

function follow(event) {
  const box = view.getBoundingClientRect();
  gaze = { x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height };
  ask();
}

function measure([entry]) {
  const css = entry.contentBoxSize[0];
  const device = entry.devicePixelContentBoxSize?.[0];
  size = {
    width_css: css.inlineSize,
    height_css: css.blockSize,
    width_px: device?.inlineSize ?? Math.round(css.inlineSize * devicePixelRatio),
    height_px: device?.blockSize ?? Math.round(css.blockSize * devicePixelRatio),
  };
  ask();
}

function cellScale() {
  return 2 ** (Number(controls.elements.scale.value) / 2);
}

function write(id, text) {
  element(id).textContent = text;
}

function count(number) {
  return number.toLocaleString("en");
}

function percent(share) {
  return `${(100 * share).toFixed(1)} %`;
}

function accuracy(error) {
  return error === null ? "–" : error.toPrecision(2);
}

async function nameScenes() {
  for (const { id } of await source.scenes(false)) controls.elements.scene.add(new Option(id, id));
}

async function describeScenes() {
  for (const scene of await source.scenes(true)) {
    const option = [...controls.elements.scene.options].find(({ value }) => value === scene.id);
    if (!option) continue;
    option.text = scene.error ? `${scene.id} (broken)` : scene.title || scene.id;
    option.title = scene.error ?? `${count(scene.triangles)} triangles, ${scene.spheres} spheres`;
  }
}

controls.addEventListener("input", () => {
  controls.elements.scale_shown.value = `× ${Number(cellScale().toPrecision(3))}`;
  ask();
});
controls.addEventListener("submit", (event) => event.preventDefault());
view.addEventListener("pointermove", follow);
view.addEventListener("pointerdown", follow);

gaze = { x: 0.5, y: 0.5 };
await nameScenes();
element("status").textContent = "Waiting for the first frame …";
new ResizeObserver(measure).observe(view);
await describeScenes();
