// The scene picker: each scene with a small picture, its size and the effects it calls for.

const THUMBNAIL = { width: 192, height: 108 };
const NO_EFFECTS = "no effects";

/** A list of the scenes in a popover. */
export class ScenePicker {
  #popover;
  #label;
  #service;
  #onPick;
  #summaries = new Map();
  #chosen = null;
  #pictures = new Map();

  /**
   * @param popover element to fill and show
   * @param label   element that names the chosen scene
   * @param service the Service
   * @param onPick  receives the id of the scene that was picked
   */
  constructor({ popover, label, service, onPick }) {
    this.#popover = popover;
    this.#label = label;
    this.#service = service;
    this.#onPick = onPick;
    popover.addEventListener("toggle", ({ newState }) => newState === "open" && this.#opened());
    popover.addEventListener("keydown", (event) => this.#move(event));
  }

  /** Learn the ids, then what each scene is. */
  async load() {
    const ids = await this.#service.sceneIds();
    for (const id of ids) this.#summaries.set(id, { id });
    this.#fill();
    return ids;
  }

  /** Learn each scene's size and effects, which may take the service a while. */
  async describe() {
    for (const summary of await this.#service.scenes()) this.#summaries.set(summary.id, summary);
    this.#fill();
    this.choose(this.#chosen);
  }

  /** Show `id` as the chosen one. */
  choose(id) {
    this.#chosen = id;
    this.#label.textContent = this.#summaries.get(id)?.title ?? id;
    for (const button of this.#popover.children) button.setAttribute("aria-current", button.dataset.scene === id);
  }

  #fill() {
    this.#popover.replaceChildren(...[...this.#summaries.values()].map((summary) => this.#entry(summary)));
    this.choose(this.#chosen);
  }

  #entry({ id, title, triangles, spheres, effects, error }) {
    const button = document.createElement("button");
    button.dataset.scene = id;
    const picture = document.createElement("img");
    Object.assign(picture, { ...THUMBNAIL, alt: "" });
    if (this.#pictures.has(id)) picture.src = this.#pictures.get(id);
    const told = document.createElement("span");
    told.append(
      line("title", title ?? id),
      line("size", error ?? (effects ? sizeOf(triangles, spheres) : "…")),
      line("effects", effects ? effects.map((name) => name.replaceAll("_", " ")).join(", ") || NO_EFFECTS : ""),
    );
    if (error) button.classList.add("broken");
    button.append(picture, told);
    button.addEventListener("click", () => {
      this.#popover.hidePopover();
      this.#onPick(id);
    });
    return button;
  }

  async #opened() {
    this.#popover.querySelector("[aria-current=true]")?.focus();
    for (const { id, error } of this.#summaries.values()) {
      if (error || this.#pictures.has(id)) continue;
      this.#pictures.set(id, "");
      const picture = await this.#service.thumbnail(id, THUMBNAIL.width, THUMBNAIL.height).catch(() => null);
      if (!picture) continue;
      this.#pictures.set(id, URL.createObjectURL(picture));
      this.#popover.querySelector(`[data-scene="${CSS.escape(id)}"] img`).src = this.#pictures.get(id);
    }
  }

  #move(event) {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const buttons = [...this.#popover.children];
    buttons.at((buttons.indexOf(document.activeElement) + step) % buttons.length).focus();
  }
}

function line(name, text) {
  const element = document.createElement("span");
  element.className = name;
  element.textContent = text;
  return element;
}

function sizeOf(triangles, spheres) {
  const parts = [];
  if (triangles) parts.push(`${triangles.toLocaleString("en")} triangles`);
  if (spheres) parts.push(`${spheres.toLocaleString("en")} ${spheres === 1 ? "sphere" : "spheres"}`);
  return parts.join(", ") || "empty";
}
