// Keyboard shortcuts, and the sheet that lists them with the gestures.

const GESTURES = [
  ["move the pointer, one finger", "gaze"],
  ["right drag, shift and drag, two fingers", "turn the camera"],
  ["wheel, pinch", "nearer, farther"],
];
const TYPED_INTO = "input:not([type=range], [type=radio], [type=checkbox]), textarea, select";
const MOVED_BY_ARROWS = "input, select, [role=tab], [popover] *";

/** Listens for keys wherever nothing is typed and no dialog is open. */
export class Keys {
  #keys;

  /** @param keys list of {keys: KeyboardEvent.key values, shown: on the sheet, else the first key, does, run}; without `does` not listed */
  constructor(keys) {
    this.#keys = keys;
    document.addEventListener("keydown", (event) => this.#press(event));
  }

  /** Fill the sheet. */
  list(sheet) {
    const listed = this.#keys.filter(({ does }) => does);
    const keys = listed.map(({ keys: [first], shown, does }) => [shown ?? first.toUpperCase(), does]);
    sheet.replaceChildren(listOf(keys), listOf(GESTURES));
  }

  #press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (event.target.matches(TYPED_INTO)) return;
    const pressed = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const isArrow = pressed.startsWith("Arrow");
    if (isArrow && event.target.matches(MOVED_BY_ARROWS)) return;
    if (pressed === " " && event.target.matches("button, a, input")) return;
    const found = this.#keys.find(({ keys }) => keys.includes(pressed));
    if (!found) return;
    if (pressed !== "Escape") event.preventDefault(); // which also closes a popover
    found.run(pressed);
  }
}

function listOf(rows) {
  const list = document.createElement("dl");
  for (const [key, does] of rows) {
    const row = document.createElement("div");
    const term = document.createElement("dt");
    const told = document.createElement("dd");
    const cap = document.createElement("kbd");
    cap.textContent = key;
    term.append(cap);
    told.textContent = does;
    row.append(term, told);
    list.append(row);
  }
  return list;
}
