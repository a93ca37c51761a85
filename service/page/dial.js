// The dial: from the fastest frame to the finest, as measured on the service's machine.

const RETRY_MS = 2000;
const SAME_WIDTH = 1.01; // factor between widths of cells that are one

const element = (id) => document.getElementById(id);

/** What accuracy costs for the scene shown, and a way along the settings that nothing beats in both. */
export class Dial {
  #service;
  #onPick;
  #onError;
  #scene = null;
  #front = [];
  #asking = null;

  /**
   * @param service asks for the table
   * @param onPick  receives {map, samples_per_cell, scale} of the setting that was turned to
   * @param onError receives what went wrong
   */
  constructor({ service, onPick, onError }) {
    this.#service = service;
    this.#onPick = onPick;
    this.#onError = onError;
    element("dial_measure").addEventListener("click", () => this.#measure());
    element("dial_place").addEventListener("input", () => {
      const { quality } = this.#front[element("dial_place").valueAsNumber];
      this.#onPick(setBy(quality));
    });
  }

  /** Another scene is shown: its table is another one. */
  forScene(scene) {
    if (scene === this.#scene) return;
    this.#scene = scene;
    this.#asking = null;
    this.#front = [];
    element("dial_place").disabled = true;
    element("dial_told").value = "–";
    element("dial_measure").hidden = element("dial_measure").disabled = false;
    note("What accuracy costs on the service's machine, for this scene, was not asked for yet.");
  }

  /** Show where on the way this quality of a request is. */
  follow(quality) {
    const place = this.#front.findIndex((setting) => same(setBy(setting.quality), setBy(quality)));
    if (place >= 0) element("dial_place").value = place;
    element("dial_told").value = place < 0 ? "–" : told(this.#front[place]);
  }

  async #measure() {
    const asking = this.#asking = {};
    element("dial_measure").disabled = true;
    try {
      for (;;) {
        const { table, progress } = await this.#service.accuracy(this.#scene);
        if (asking !== this.#asking) return;
        if (table) {
          this.#offer(table);
          return;
        }
        note(`Measuring while the picture rests: ${progress.done} of ${progress.of} steps.`);
        await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
        if (asking !== this.#asking) return;
      }
    } catch (error) {
      if (asking !== this.#asking) return;
      element("dial_measure").disabled = false;
      this.#onError(error);
    }
  }

  #offer({ display, settings }) {
    this.#front = pareto(settings);
    const dial = element("dial_place");
    dial.max = this.#front.length - 1;
    dial.disabled = false;
    element("dial_measure").hidden = true;
    note(`Time of a whole ${display.width_px} × ${display.height_px} frame, and its error (rms, linear).`);
    this.#onPick(null);
  }
}

/** The settings that no other beats in both time and error, fastest first. */
function pareto(settings) {
  const byTime = settings.toSorted((a, b) => a.time_ms.median - b.time_ms.median || a.accuracy.rms - b.accuracy.rms);
  let least = Infinity;
  return byTime.filter(({ accuracy }) => {
    const finer = accuracy.rms < least;
    if (finer) least = accuracy.rms;
    return finer;
  });
}

/** What the dial sets of a quality. */
function setBy({ map, samples_per_cell, acuity }) {
  return { map, samples_per_cell, scale: acuity.scale };
}

function same(one, other) {
  const ratio = one.scale / other.scale;
  return one.map === other.map && one.samples_per_cell === other.samples_per_cell
    && (one.map === "full" || (ratio < SAME_WIDTH && ratio > 1 / SAME_WIDTH));
}

function told({ time_ms, accuracy }) {
  return `${time_ms.median.toPrecision(3)} ms, error ${accuracy.rms.toPrecision(2)}`;
}

function note(text) {
  element("dial_note").textContent = text;
}
