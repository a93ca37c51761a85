// What can be drawn over the frame: the gaze, the region around it, the cells, the rays they cost.

const RINGS = [[2.5, "#ffffff"], [5, "#ffc83c"], [10, "#ff6e28"]]; // as in renderer/overlay.py: degrees, colour
const RING_STEPS = 128;
const CROSS = { opening: 5, arm: 14 }; // CSS px
const BEHIND = 1e-6; // a direction this little towards the screen does not meet it
/** Colours as in renderer/overlay.py. */
const LEGENDS = {
  cells: {
    title: "side of a cell [px]",
    steps: [["1", null], ["2", "#440154"], ["4", "#3b528b"], ["8", "#21918c"], ["16", "#5ec962"], ["32", "#fde725"]],
  },
  rays: {
    title: "camera rays a pixel",
    steps: [["1/64", "#000004"], ["1/8", "#57106e"], ["1", "#bc3754"], ["8", "#f98e09"], ["64", "#fcffa4"]],
  },
};

/** The overlays and which of them are on; `cells` and `rays` exclude each other. */
export class Overlays {
  #marks;
  #drawn;
  #cells;
  #onError;
  #on;
  #shown = null;
  #drawnFor = null;
  #busy = false;

  /**
   * @param marks canvas over the frame for lines
   * @param drawn canvas over the frame for drawings of the service, blended
   * @param cells asks the service for one: (query) => Promise of an ImageBitmap
   * @param onError receives the error where the service refuses
   * @param on    {gaze, region, cells, rays}
   */
  constructor({ marks, drawn, cells, onError, on }) {
    this.#marks = marks.getContext("2d");
    this.#drawn = drawn;
    this.#cells = cells;
    this.#onError = onError;
    this.#on = { ...on };
  }

  get on() {
    return { ...this.#on };
  }

  toggle(name) {
    this.#on[name] = !this.#on[name];
    if (this.#on[name] && name === "cells") this.#on.rays = false;
    if (this.#on[name] && name === "rays") this.#on.cells = false;
    this.#draw();
  }

  /**
   * Draw over a frame.
   *
   * @param gaze       of the frame [px of the display]; null where it has none
   * @param display    of the frame, as in a render request, complete
   * @param query      parameters of /v1/cellmap for the frame
   * @param pixelRatio the frame's pixels to a CSS pixel
   */
  show(shown) {
    this.#shown = shown;
    this.#draw();
  }

  #draw() {
    const kind = this.#on.cells ? "cells" : this.#on.rays ? "rays" : null;
    this.#drawn.hidden = kind === null;
    this.#drawn.className = kind ?? "";
    if (!this.#shown) return;
    const { gaze, display, pixelRatio } = this.#shown;
    const context = this.#marks;
    const canvas = context.canvas;
    if (canvas.width !== display.width_px || canvas.height !== display.height_px) {
      canvas.width = display.width_px;
      canvas.height = display.height_px;
    }
    context.clearRect(0, 0, canvas.width, canvas.height);
    if (gaze && this.#on.region) this.#drawRegion(gaze, display, pixelRatio);
    if (gaze && this.#on.gaze) this.#drawGaze(gaze, pixelRatio);
    if (gaze && kind) this.#fetch(kind);
  }

  async #fetch(kind) {
    const wanted = JSON.stringify({ ...this.#shown.query, drawing: kind, ...(kind === "cells" && { samples_per_cell: 1 }) });
    if (this.#busy || wanted === this.#drawnFor) return;
    this.#busy = true;
    try {
      const picture = await this.#cells(JSON.parse(wanted));
      this.#drawn.width = picture.width;
      this.#drawn.height = picture.height;
      this.#drawn.getContext("2d").drawImage(picture, 0, 0);
      picture.close();
    } catch (error) {
      this.#onError(error);
    }
    this.#drawnFor = wanted;
    this.#busy = false;
    this.#draw();
  }

  #drawRegion(gaze, display, ratio) {
    for (const [degrees, colour] of RINGS) {
      const outline = isoEccentric(display, gaze, degrees);
      for (const [stroke, width] of [["#000a", 3], [colour, 1.5]]) {
        this.#marks.strokeStyle = stroke;
        this.#marks.lineWidth = width * ratio;
        this.#marks.beginPath();
        for (const [index, point] of outline.entries()) {
          if (!point) continue;
          if (outline.at(index - 1)) this.#marks.lineTo(...point);
          else this.#marks.moveTo(...point);
        }
        this.#marks.stroke();
      }
    }
  }

  #drawGaze({ x, y }, ratio) {
    const context = this.#marks;
    const [opening, arm] = [CROSS.opening * ratio, CROSS.arm * ratio];
    for (const [stroke, width] of [["#000b", 4], ["#ff4a3d", 2]]) {
      context.strokeStyle = stroke;
      context.lineWidth = width * ratio;
      context.beginPath();
      for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
        context.moveTo(x + dx * opening, y + dy * opening);
        context.lineTo(x + dx * arm, y + dy * arm);
      }
      context.stroke();
    }
  }
}

/** The scale of a drawing: its title, and [label, colour] of its steps; null where it has none. */
export function legendOf(kind) {
  return LEGENDS[kind] ?? null;
}

/**
 * The line on the screen that lies `degrees` from the gaze, for an eye in front of the screen's centre.
 *
 * @returns points [x, y] in display pixels, null where the line leaves the half-space in front of the eye
 */
export function isoEccentric(display, gaze, degrees) {
  const pitchX = display.width_cm / display.width_px;
  const pitchY = display.height_cm / display.height_px;
  const towards = [
    (gaze.x - display.width_px / 2) * pitchX,
    (gaze.y - display.height_px / 2) * pitchY,
    display.distance_cm,
  ];
  const length = Math.hypot(...towards);
  const [gx, gy, gz] = towards.map((part) => part / length);
  const across = Math.hypot(gx, gz); // above 0: the gaze is on the screen's plane, in front of the eye
  const u = [gz / across, 0, -gx / across];
  const v = [(-gx * gy) / across, across, (-gy * gz) / across];
  const [cosine, sine] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
  return Array.from({ length: RING_STEPS + 1 }, (_, step) => {
    const turn = (2 * Math.PI * step) / RING_STEPS;
    const [x, y, z] = [gx, gy, gz].map(
      (part, axis) => cosine * part + sine * (Math.cos(turn) * u[axis] + Math.sin(turn) * v[axis]),
    );
    if (z < BEHIND) return null;
    const reach = display.distance_cm / z;
    return [(x * reach) / pitchX + display.width_px / 2, (y * reach) / pitchY + display.height_px / 2];
  });
}
