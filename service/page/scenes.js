// The scene picker: each scene with a small picture, its size and the effects it calls for.

const THUMBNAIL = { width: 192, height: 108 };
const NO_EFFECTS = "no effects";

/** A list of the scenes in a popover. */
export class ScenePicker {
  #popover;
  #label;
  #service;
  #onPick;
  #entries = new Map(); // by id: the entry, and what it tells once that is known
  #chosen = null;

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

  /** Learn which scenes there are: their ids. */
  async load() {
    const ids = await this.#service.sceneIds();
    for (const id of ids) this.#entries.set(id, this.#entry(id));
    this.#popover.replaceChildren(...[...this.#entries.values()].map(({ button }) => button));
    return ids;
  }

  /** Show `id` as the chosen one. */
  choose(id) {
    this.#chosen = id;
    this.#label.textContent = this.#entries.get(id)?.title.textContent ?? id;
    for (const [each, { button }] of this.#entries) button.setAttribute("aria-current", each === id);
  }

  /** Learn a scene's title, size and effects. */
  async describe(id) {
    const entry = this.#entries.get(id);
    if (!entry || entry.known) return;
    entry.known = true;
    try {
      const { title, triangles, spheres, effects } = await this.#service.scene(id);
      entry.title.textContent = title;
      entry.size.textContent = sizeOf(triangles, spheres);
      entry.effects.textContent = effects.map(({ name }) => name.replaceAll("_", " ")).join(", ") || NO_EFFECTS;
    } catch (error) {
      entry.size.textContent = error.message;
      entry.button.classList.add("broken");
    }
    if (id === this.#chosen) this.choose(id);
  }

  #entry(id) {
    const [title, size, effects] = [line("title", id), line("size", "…"), line("effects", "")];
    const picture = Object.assign(document.createElement("img"), { ...THUMBNAIL, alt: "" });
    const told = document.createElement("span");
    told.append(title, size, effects);
    const button = document.createElement("button");
    button.dataset.scene = id;
    button.append(picture, told);
    button.addEventListener("click", () => {
      this.#popover.hidePopover();
      this.#onPick(id);
    });
    return { button, picture, title, size, effects, known: false };
  }

  /** Only who opens the picker waits for every scene to be loaded. */
  async #opened() {
    this.#entries.get(this.#chosen)?.button.focus();
    for (const [id, { button, picture }] of this.#entries) {
      await this.describe(id);
      if (picture.src || button.classList.contains("broken")) continue;
      const shown = await this.#service.thumbnail(id, THUMBNAIL.width, THUMBNAIL.height).catch(() => null);
      if (shown) picture.src = URL.createObjectURL(shown);
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
