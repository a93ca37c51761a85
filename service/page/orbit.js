// Turning the camera about the point it looks at: right or shift drag, two fingers, the wheel, arrow keys.

const TURN_PER_VIEW_RAD = Math.PI; // a drag across the whole view turns by half a circle
const STEEPEST_RAD = (85 / 180) * Math.PI;
const WHEEL_STEP_PX = 500; // of wheel travel for a factor e in distance
const KEY_TURN_RAD = Math.PI / 36;
const KEY_ZOOM = 1.1;
const NEAREST = 0.05; // share of the scene's own distance
const FARTHEST = 20;
const LINE_PX = 16; // wheels that count in lines

/** A view kept as angles and distance about the scene's own. */
export class Orbit {
  #home = null;
  #turn = { yaw: 0, pitch: 0, zoom: 1 };
  #onTurn;
  #fingers = new Map();

  /**
   * @param view   element to drag over
   * @param onTurn called after each change
   */
  constructor({ view, onTurn }) {
    this.#onTurn = onTurn;
    view.addEventListener("contextmenu", (event) => event.preventDefault());
    view.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    view.addEventListener("pointerdown", (event) => this.#press(event));
    view.addEventListener("pointermove", (event) => this.#drag(event));
    for (const name of ["pointerup", "pointercancel"]) {
      view.addEventListener(name, (event) => this.#fingers.delete(event.pointerId));
    }
  }

  /** Begin anew with a scene; `home` is its own camera, null while that is not known. */
  set home(home) {
    this.#home = home;
    this.#turn = { yaw: 0, pitch: 0, zoom: 1 };
  }

  get home() {
    return this.#home;
  }

  /** Whether a drag is under way. */
  get turning() {
    return this.#fingers.size > 1 || [...this.#fingers.values()].some(({ alone }) => alone);
  }

  get moved() {
    const { yaw, pitch, zoom } = this.#turn;
    return yaw !== 0 || pitch !== 0 || zoom !== 1;
  }

  /** The camera of a render request; null: the scene's own. */
  get camera() {
    return this.#home && this.moved ? orbited(this.#home, this.#turn) : null;
  }

  /** Back to the scene's own view. */
  reset() {
    this.#turn = { yaw: 0, pitch: 0, zoom: 1 };
    this.#onTurn();
  }

  /** Turn by whole steps to the right and up, as a key does. */
  step(right, up) {
    this.#by(right * KEY_TURN_RAD, up * KEY_TURN_RAD, 1);
  }

  /** Come nearer by whole steps, as a key does. */
  near(steps) {
    this.#by(0, 0, KEY_ZOOM ** -steps);
  }

  #by(yaw, pitch, zoom) {
    if (!this.#home) return;
    const level = levelOf(this.#home);
    const steepest = Math.max(STEEPEST_RAD, Math.abs(level));
    this.#turn = {
      yaw: this.#turn.yaw + yaw,
      pitch: clamp(level + this.#turn.pitch + pitch, -steepest, steepest) - level,
      zoom: clamp(this.#turn.zoom * zoom, NEAREST, FARTHEST),
    };
    this.#onTurn();
  }

  #wheel(event) {
    event.preventDefault();
    const travel = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? 1 : LINE_PX);
    this.#by(0, 0, Math.exp(travel / WHEEL_STEP_PX));
  }

  #press(event) {
    const turns = event.pointerType === "touch" || event.button === 2 || (event.button === 0 && event.shiftKey);
    if (!turns) return;
    const alone = event.pointerType !== "touch";
    this.#fingers.set(event.pointerId, { x: event.clientX, y: event.clientY, alone });
    event.currentTarget.setPointerCapture(event.pointerId);
  }

  #drag(event) {
    const before = this.#fingers.get(event.pointerId);
    if (!before) return;
    const now = { ...before, x: event.clientX, y: event.clientY };
    this.#fingers.set(event.pointerId, now);
    if (!this.turning) return;
    const box = event.currentTarget.getBoundingClientRect();
    let zoom = 1;
    if (this.#fingers.size === 2) {
      const [other] = [...this.#fingers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      zoom = Math.hypot(before.x - other.x, before.y - other.y) / Math.hypot(now.x - other.x, now.y - other.y);
    }
    const turn = TURN_PER_VIEW_RAD / box.width;
    this.#by(-(now.x - before.x) * turn, (now.y - before.y) * turn, Number.isFinite(zoom) && zoom > 0 ? zoom : 1);
  }
}

/**
 * A camera turned about its `look_at`.
 *
 * @param home camera of a render request
 * @param turn `yaw` to the right about `up`, `pitch` upwards, both [rad]; `zoom`: factor on the distance
 */
export function orbited(home, { yaw, pitch, zoom }) {
  const up = unit(home.up);
  const offset = minus(home.position, home.look_at);
  const distance = Math.hypot(...offset);
  const across = unit(minus(offset, times(up, dot(offset, up))));
  const around = plus(times(across, Math.cos(yaw)), times(cross(up, across), Math.sin(yaw)));
  const level = levelOf(home) + pitch;
  const direction = plus(times(around, Math.cos(level)), times(up, Math.sin(level)));
  return { ...home, position: plus(home.look_at, times(direction, distance * zoom)) };
}

/** How far a camera stands above what it looks at [rad]. */
function levelOf({ position, look_at, up }) {
  return Math.asin(clamp(dot(unit(minus(position, look_at)), unit(up)), -1, 1));
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const plus = (a, b) => a.map((value, axis) => value + b[axis]);
const minus = (a, b) => a.map((value, axis) => value - b[axis]);
const times = (a, factor) => a.map((value) => value * factor);
const unit = (a) => times(a, 1 / Math.hypot(...a));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
