// Calibration targets of an eye tracker, shown full screen while a bridge asks for them.

/** Shows the target that a gaze source asks to be looked at. */
export class Targets {
  #layer;
  #dot;
  #told;
  #toWindow;

  /**
   * @param layer    element over everything, with an `i` and a `p`
   * @param toWindow shares of the display {x, y} to CSS pixels of the window
   */
  constructor({ layer, toWindow }) {
    this.#layer = layer;
    this.#dot = layer.querySelector("i");
    this.#told = layer.querySelector("p");
    this.#toWindow = toWindow;
  }

  /** Show a target message of the wire; one without a place ends the calibration. */
  show({ x, y, unit, index, count }, display) {
    const done = x === null || y === null || !display;
    this.#layer.hidden = done;
    document.body.classList.toggle("calibrating", !done);
    if (done) return;
    const point = unit === "fraction" ? { x, y } : { x: x / display.width_px, y: y / display.height_px };
    const place = this.#toWindow(point);
    this.#dot.style.transform = `translate(${place.x}px, ${place.y}px)`;
    this.#told.textContent = `Look at the point: ${index + 1} of ${count}. Esc stops showing it.`;
  }

  /** Whether a target is shown. */
  get shown() {
    return !this.#layer.hidden;
  }

  hide() {
    this.#layer.hidden = true;
    document.body.classList.remove("calibrating");
  }
}
