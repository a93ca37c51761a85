// The pointer as gaze: of all its moves only the newest is told, once for each picture the browser draws.

const NS_PER_MS = 1e6;
const MICROSECONDS_PER_MS = 1000;

/** Follows the mouse or one finger over the view. */
export class PointerGaze {
  #toDisplay;
  #look;
  #busy;
  #firstSeq = Date.now() * MICROSECONDS_PER_MS; // so that numbers of other senders are not taken for this one's
  #seq = this.#firstSeq;
  #newest = null;
  #due = false;
  #on = true;
  #held = false;

  /**
   * @param view      element to follow the pointer over
   * @param toDisplay (clientX, clientY) to {x, y} in shares of the display
   * @param look      receives a gaze message's fields
   * @param busy      whether the pointer does something else now
   */
  constructor({ view, toDisplay, look, busy }) {
    this.#toDisplay = toDisplay;
    this.#look = look;
    this.#busy = busy;
    for (const name of ["pointermove", "pointerdown"]) view.addEventListener(name, (event) => this.#follow(event));
  }

  /** Follow the pointer, or leave the gaze to others. */
  set on(on) {
    this.#on = on;
  }

  /** While held, the gaze stays where it is and the pointer is free: to look at what lies away from the gaze. */
  get held() {
    return this.#held;
  }

  set held(held) {
    this.#held = held;
  }

  /** Look at a point {x, y} in shares of the display, wherever the pointer is. */
  lookAt(point) {
    this.#newest = { ...point, timeMs: performance.now() };
    this.#tell();
  }

  /** When the gaze of a frame was at its place, by performance.now(); null for the gaze of somebody else. */
  seenAt({ seq, captured_time_ns }) {
    return seq > this.#firstSeq && seq <= this.#seq ? captured_time_ns / NS_PER_MS : null;
  }

  #follow(event) {
    if (!this.#on || this.#held || this.#busy() || !event.isPrimary) return;
    this.#newest = { ...this.#toDisplay(event.clientX, event.clientY), timeMs: event.timeStamp };
    if (this.#due) return;
    this.#due = true;
    requestAnimationFrame(() => {
      this.#due = false;
      this.#tell();
    });
  }

  #tell() {
    const { x, y, timeMs } = this.#newest;
    this.#look({ x, y, unit: "fraction", seq: ++this.#seq, captured_time_ns: Math.round(timeMs * NS_PER_MS) });
  }
}
