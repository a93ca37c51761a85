// The screen in centimetres: measured against a bank card once, kept in this browser.

const KEY = "gazetrace-screen";
const CARD_WIDTH_CM = 8.56; // ISO/IEC 7810 ID-1
const CARD_HEIGHT_CM = 5.398;
const CSS_PITCH_CM = 2.54 / 96; // what CSS takes a pixel for, and screens seldom have
const DISTANCE_CM = 60;
const FINEST_PITCH_CM = 0.003;
const COARSEST_PITCH_CM = 0.2;

/** Size of a screen pixel and the distance it is seen from. */
export class ScreenSize {
  #kept = { pitch_cm: null, distance_cm: DISTANCE_CM };

  constructor() {
    try {
      const { pitch_cm, distance_cm } = JSON.parse(localStorage.getItem(KEY)) ?? {};
      if (pitch_cm >= FINEST_PITCH_CM && pitch_cm <= COARSEST_PITCH_CM) this.#kept.pitch_cm = pitch_cm;
      if (distance_cm > 0) this.#kept.distance_cm = distance_cm;
    } catch {
      localStorage.removeItem(KEY);
    }
  }

  get calibrated() {
    return this.#kept.pitch_cm !== null;
  }

  /** Width of a device pixel [cm]; what CSS takes it for until it is measured. */
  pitchCm(ratio) {
    return this.#kept.pitch_cm ?? CSS_PITCH_CM / ratio;
  }

  get distanceCm() {
    return this.#kept.distance_cm;
  }

  keep(change) {
    Object.assign(this.#kept, change);
    localStorage.setItem(KEY, JSON.stringify(this.#kept));
  }
}

/** The dialog in which a rectangle is fitted to a card held against the screen. */
export class CardFitting {
  #dialog;
  #screen;
  #card;
  #slider;
  #told;
  #onKept;

  /**
   * @param dialog with #card, a range #card_size, #card_told, and buttons of value `keep`, `forget` and none
   * @param screen the ScreenSize to measure
   * @param onKept called when the size of a pixel has changed
   */
  constructor({ dialog, screen, onKept }) {
    this.#dialog = dialog;
    this.#screen = screen;
    this.#onKept = onKept;
    this.#card = dialog.querySelector("#card");
    this.#slider = dialog.querySelector("#card_size");
    this.#told = dialog.querySelector("#card_told");
    this.#slider.addEventListener("input", () => this.#fit(this.#slider.valueAsNumber));
    this.#card.addEventListener("pointerdown", (event) => this.#card.setPointerCapture(event.pointerId));
    this.#card.addEventListener("pointermove", (event) => this.#drag(event));
    dialog.addEventListener("close", () => this.#close(dialog.returnValue));
  }

  open() {
    this.#dialog.returnValue = "";
    this.#dialog.showModal();
    this.#fit(CARD_WIDTH_CM / (this.#screen.pitchCm(devicePixelRatio) * devicePixelRatio));
  }

  #drag(event) {
    if (!event.buttons) return;
    const box = this.#card.getBoundingClientRect();
    this.#fit(event.clientX - box.left);
  }

  #fit(width) {
    this.#slider.value = width;
    const fitted = this.#slider.valueAsNumber;
    this.#card.style.width = `${fitted}px`;
    this.#card.style.height = `${(fitted * CARD_HEIGHT_CM) / CARD_WIDTH_CM}px`;
    const perInch = (fitted * devicePixelRatio * 2.54) / CARD_WIDTH_CM;
    this.#told.textContent = `${perInch.toFixed(1)} pixels to the inch`;
  }

  #close(answer) {
    if (answer !== "keep" && answer !== "forget") return;
    const pitch_cm = answer === "keep" ? CARD_WIDTH_CM / (this.#slider.valueAsNumber * devicePixelRatio) : null;
    this.#screen.keep({ pitch_cm });
    this.#onKept();
  }
}
