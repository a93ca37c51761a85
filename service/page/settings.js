// The forms: what the frames may cost and where the eye is; kept in this browser.

const KEY = "gazetrace-settings";

/** What the selects offer where the service knows it; a value it knows and this table does not is shown as it is. */
const NAMES = {
  map: { aligned: "aligned", scanline: "scanline (the paper's)", full: "one a pixel" },
  model: { "peli": "Peli (the paper's)", "geisler-perry": "Geisler and Perry", "guenter": "Guenter et al.",
    "watson": "Watson", "stelacsf": "stelaCSF" },
};
const SAMPLES = [1, 2, 4, 8, 16, 32, 64, 128, 256];
const ERRORS = [0.1, 0.05, 0.02, 0.01, 0.005];
const DEADLINES_MS = [16, 33, 50, 70, 100, 200, 500];
const DEFAULTS = {
  samples_per_cell: "16", deadline_ms: "", max_error: "", antialiasing: "stochastic", map: "aligned", reconstruction: "nearest",
  model: "peli", scale: "0", margin_deg: "0", shadow_samples: "4", max_depth: "5", format: "jpeg", image_quality: "90",
};
/** Fields of a request, by the control that sets them, where the names differ. */
const CONTROL_OF = {
  "quality.acuity.scale": "scale", "quality.acuity.margin_deg": "margin_deg", "quality.acuity.model": "model",
  "display.distance_cm": "distance_cm", "display": "size", "format": "format", "image_quality": "image_quality",
};

/** The settings as the forms hold them. */
export class Settings {
  #form;
  #onChange;
  #effectsOff = new Set();

  /**
   * @param form     the form #settings
   * @param onChange called with the name of the control that was changed
   */
  constructor({ form, onChange }) {
    this.#form = form;
    this.#onChange = onChange;
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("input", ({ target }) => this.#changed(target));
    form.querySelector("#defaults").addEventListener("click", () => this.#reset());
  }

  /** Offer what the service knows (schemas of quality and acuity), then take up what was kept. */
  offer({ quality, acuity }) {
    const choices = { antialiasing: quality.antialiasing, map: quality.map, reconstruction: quality.reconstruction,
      model: acuity.model };
    for (const [name, schema] of Object.entries(choices)) {
      const values = schema.enum ?? [schema.const];
      this.#field(name).replaceChildren(...values.map((value) => new Option(NAMES[name]?.[value] ?? value, value)));
    }
    const most = quality.samples_per_cell.maximum;
    const samples = SAMPLES.filter((count) => count <= most).map((count) => new Option(count, count));
    this.#field("samples_per_cell").replaceChildren(...samples);
    const deadlines = DEADLINES_MS.map((time) => new Option(`${time} ms`, time));
    this.#field("deadline_ms").replaceChildren(new Option("default", ""), ...deadlines);
    const errors = ERRORS.map((error) => new Option(`${100 * error} % of white`, error));
    this.#field("max_error").replaceChildren(new Option("none", ""), ...errors);
    this.#field("shadow_samples").max = quality.shadow_samples.maximum;
    this.#field("max_depth").max = quality.max_depth.maximum;
    this.#field("margin_deg").max = acuity.margin_deg.maximum;
    this.#take({ ...DEFAULTS, ...kept() });
  }

  /** `quality` of a render request. */
  get quality() {
    const { samples_per_cell, deadline_ms, max_error, antialiasing, map, reconstruction, model, margin_deg,
      shadow_samples, max_depth } = this.#values();
    return {
      map,
      samples_per_cell: Number(samples_per_cell),
      antialiasing,
      shadow_samples: Number(shadow_samples),
      max_depth: Number(max_depth),
      effects: [...this.#effectsOff].map((name) => `-${name}`),
      acuity: { model, scale: this.#scale(), margin_deg: Number(margin_deg) },
      reconstruction,
      ...(deadline_ms && { deadline_ms: Number(deadline_ms) }),
      ...(max_error && { max_error: Number(max_error) }),
    };
  }

  /** Simulate an effect that a scene calls for, or not. */
  toggleEffect(name) {
    if (!this.#effectsOff.delete(name)) this.#effectsOff.add(name);
    this.#onChange("effects");
  }

  /** `format` and `image_quality` of a render request. */
  get encoding() {
    const { format, image_quality } = this.#values();
    return { format, image_quality: Number(image_quality) };
  }

  /** Size of the frames {width_px, height_px}; null: the window's. */
  get size() {
    const [width_px, height_px] = this.#field("size").value.split("x").map(Number);
    return height_px ? { width_px, height_px } : null;
  }

  get distanceCm() {
    return this.#field("distance_cm").valueAsNumber;
  }

  set distanceCm(distance) {
    this.#field("distance_cm").value = distance;
  }

  /** Whether gaze comes from an external tracker. */
  get tracked() {
    return this.#field("source").value === "tracker";
  }

  set tracked(tracked) {
    this.#field("source").value = tracked ? "tracker" : "pointer";
    this.#onChange("source");
  }

  /** Take over what a quality says of cells and samples; all of the samples, whatever the error. */
  turnTo({ map, samples_per_cell, scale }) {
    this.#field("map").value = map;
    this.#field("samples_per_cell").value = samples_per_cell;
    this.#field("scale").value = Math.round(4 * Math.log2(scale)) / 2;
    this.#field("max_error").value = "";
    this.#changed(this.#field("samples_per_cell"));
  }

  /** Twice or half as many samples a cell. */
  stepSamples(up) {
    const select = this.#field("samples_per_cell");
    const index = Math.min(select.options.length - 1, Math.max(0, select.selectedIndex + (up ? 1 : -1)));
    select.selectedIndex = index;
    this.#changed(select);
  }

  /** Mark the control that sets `field` of a request as wrong; null: none is. */
  blame(field) {
    for (const control of this.#form.elements) control.removeAttribute("aria-invalid");
    if (!field) return;
    const name = CONTROL_OF[field] ?? (field.startsWith("display.") ? "size" : field.split(".").at(-1));
    this.#form.elements.namedItem(name)?.setAttribute?.("aria-invalid", "true");
  }

  #field(name) {
    return this.#form.elements.namedItem(name);
  }

  #values() {
    return Object.fromEntries(Object.keys(DEFAULTS).map((name) => [name, this.#field(name).value]));
  }

  #scale() {
    return 2 ** (Number(this.#field("scale").value) / 2);
  }

  #changed(control) {
    if (!control.name || !control.checkValidity()) {
      control.reportValidity();
      return;
    }
    localStorage.setItem(KEY, JSON.stringify(this.#values()));
    this.#tell();
    this.#onChange(control.name);
  }

  #reset() {
    localStorage.removeItem(KEY);
    this.#effectsOff.clear();
    this.#take(DEFAULTS);
    this.#onChange("defaults");
  }

  #take(values) {
    for (const [name, value] of Object.entries(values)) {
      const control = this.#field(name);
      control.value = value;
      if (!control.value || !control.checkValidity()) control.value = DEFAULTS[name];
    }
    this.#tell();
  }

  #tell() {
    this.#form.querySelector("#scale_shown").value = `× ${Number(this.#scale().toPrecision(3))}`;
    this.#form.querySelector("#image_quality_shown").value = this.#field("image_quality").value;
    this.#field("image_quality").disabled = this.#field("format").value === "png";
  }
}

function kept() {
  try {
    const values = JSON.parse(localStorage.getItem(KEY)) ?? {};
    return Object.fromEntries(Object.entries(values).filter(([name]) => name in DEFAULTS));
  } catch {
    return {};
  }
}
