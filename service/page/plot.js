// Accuracy against time: each rest of the gaze draws a line, from its first frame to its last sample.

const PAST_LINES = 12;
const FIRST_MS = 10;
const LAST_MS = 100_000;
const FEWEST_DECADES = 2;
const HIGHEST_ERROR = 1;
const LOWEST_ERROR = 1e-6;
const TIMES = [[10, "10 ms"], [100, "0.1 s"], [1000, "1 s"], [10_000, "10 s"], [100_000, ""]];
const LINES = [{ value: "rms", colour: "--series-a" }, { value: "foveal", colour: "--series-b" }];
const LEFT = 34;
const BOTTOM = 18;
const TOP = 6;
const RIGHT = 6;

/** Estimated error of the frames (log) against time since the gaze came to rest (log). */
export class AccuracyPlot {
  #canvas;
  #runs = [];
  #due = false;

  constructor(canvas) {
    this.#canvas = canvas;
    new ResizeObserver(() => this.#soon()).observe(canvas);
  }

  /**
   * Note a frame.
   *
   * @param fresh  whether it begins a new line: the gaze moved, or another configuration
   * @param timeMs since the gaze of the line's first frame was received
   */
  add({ fresh, timeMs, rms, foveal }) {
    if (rms === null && foveal === null) return;
    if (fresh || !this.#runs.length) this.#runs.push([]);
    if (this.#runs.length > PAST_LINES) this.#runs.shift();
    this.#runs.at(-1).push({ timeMs: Math.max(FIRST_MS, timeMs), rms, foveal });
    this.#soon();
  }

  clear() {
    this.#runs = [];
    this.#soon();
  }

  #soon() {
    if (this.#due) return;
    this.#due = true;
    requestAnimationFrame(() => {
      this.#due = false;
      this.#draw();
    });
  }

  #draw() {
    const canvas = this.#canvas;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    canvas.width = Math.round(width * devicePixelRatio);
    canvas.height = Math.round(height * devicePixelRatio);
    const context = canvas.getContext("2d");
    context.scale(devicePixelRatio, devicePixelRatio);
    const style = getComputedStyle(canvas);
    const [low, high] = this.#decades();
    const x = scale(Math.log10(FIRST_MS), Math.log10(LAST_MS), LEFT, width - RIGHT);
    const y = scale(low, high, height - BOTTOM, TOP);
    this.#drawAxes(context, style, x, y, [low, high], width, height);
    for (const [age, run] of [...this.#runs].reverse().entries()) {
      context.globalAlpha = age === 0 ? 1 : 0.35 * (1 - age / PAST_LINES);
      for (const { value, colour } of LINES) {
        drawLine(context, style.getPropertyValue(colour), run, ({ timeMs }) => x(Math.log10(timeMs)), (point) =>
          point[value] === null ? null : y(Math.log10(clampError(point[value]))));
      }
    }
    context.globalAlpha = 1;
  }

  #decades() {
    const errors = this.#runs.flat().flatMap(({ rms, foveal }) => [rms, foveal]).filter((error) => error !== null);
    if (!errors.length) return [-3, -1];
    const high = Math.ceil(Math.log10(clampError(Math.max(...errors))));
    const low = Math.floor(Math.log10(clampError(Math.min(...errors))));
    return [Math.min(low, high - FEWEST_DECADES), high];
  }

  #drawAxes(context, style, x, y, [low, high], width, height) {
    context.strokeStyle = style.getPropertyValue("--line");
    context.fillStyle = style.getPropertyValue("--quiet");
    context.font = `11px ${style.fontFamily}`;
    context.beginPath();
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (let decade = low; decade <= high; decade += 1) {
      context.moveTo(LEFT, y(decade));
      context.lineTo(width - RIGHT, y(decade));
      context.fillText(`1e${decade}`, LEFT - 5, y(decade));
    }
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    for (const [timeMs, label] of TIMES) {
      const at = x(Math.log10(timeMs));
      context.moveTo(at, y(low));
      context.lineTo(at, y(high));
      context.fillText(label, Math.max(at, LEFT + 12), height - 4);
    }
    context.stroke();
  }
}

function drawLine(context, colour, run, x, y) {
  const points = run.map((point) => [x(point), y(point)]).filter(([, height]) => height !== null);
  context.strokeStyle = context.fillStyle = colour;
  context.lineWidth = 1.5;
  context.beginPath();
  for (const [left, top] of points) context.lineTo(left, top);
  context.stroke();
  for (const [left, top] of points) context.fillRect(left - 1.5, top - 1.5, 3, 3);
}

function scale(from, to, start, end) {
  return (value) => start + ((value - from) / (to - from)) * (end - start);
}

function clampError(error) {
  return Math.min(HIGHEST_ERROR, Math.max(LOWEST_ERROR, error));
}
