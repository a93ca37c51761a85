// Where frames come from. The page knows this module alone; how frames travel stays in here.

const TOKEN_KEY = "gazetrace-token";
const RETRY_MS = 1000;

/** What went wrong, in one line fit to show. */
export class ServiceError extends Error {}

/** The service or its network is away for a moment; asking again may help. */
export class NotNow extends ServiceError {}

/**
 * Asks for frames, one at a time: while one is on its way only the newest order waits.
 *
 * An order is a render request of the service plus `show_cells`.
 */
export class FrameSource {
  #onFrame;
  #onError;
  #askToken;
  #waiting = null;
  #busy = false;

  /**
   * @param onFrame  receives {picture, cells, header, roundTripMs}; the pictures are ImageBitmaps, cells may be null
   * @param onError  receives a ServiceError; after NotNow the newest order is asked again by itself
   * @param askToken is called with a reason and resolves to the token to use
   */
  constructor({ onFrame, onError, askToken }) {
    this.#onFrame = onFrame;
    this.#onError = onError;
    this.#askToken = askToken;
  }

  /** The scenes of the service, by their ids alone or with details; waits until it answers. */
  async scenes(details) {
    for (;;) {
      try {
        return (await (await this.#fetch(`v1/scenes?details=${details}`)).json()).scenes;
      } catch (error) {
        this.#onError(error);
        if (!(error instanceof NotNow)) throw error;
        await wait(RETRY_MS);
      }
    }
  }

  /** Ask for a frame; an older order that still waits is forgotten. */
  ask(order) {
    this.#waiting = order;
    if (!this.#busy) this.#work();
  }

  async #work() {
    this.#busy = true;
    while (this.#waiting) {
      const order = this.#waiting;
      this.#waiting = null;
      try {
        this.#onFrame(await this.#frame(order));
      } catch (error) {
        this.#onError(error);
        if (error instanceof NotNow) {
          await wait(RETRY_MS);
          this.#waiting ??= order;
        }
      }
    }
    this.#busy = false;
  }

  async #frame({ show_cells, ...request }) {
    const started = performance.now();
    const [reply, cells] = await Promise.all([
      this.#fetch("v1/render", {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify(request),
      }),
      show_cells ? this.#cells(request) : null,
    ]);
    const picture = await createImageBitmap(await reply.blob());
    const header = JSON.parse(reply.headers.get("Gazetrace-Frame"));
    return { picture, cells, header, roundTripMs: performance.now() - started };
  }

  async #cells({ gaze, display, quality }) {
    const query = new URLSearchParams({
      gaze_x: gaze.x,
      gaze_y: gaze.y,
      ...display,
      map: quality.map,
      acuity_scale: quality.acuity.scale,
      format: "png",
    });
    return createImageBitmap(await (await this.#fetch(`v1/cellmap?${query}`)).blob());
  }

  async #fetch(path, options = {}) {
    for (;;) {
      const token = sessionStorage.getItem(TOKEN_KEY);
      const headers = { ...options.headers, ...(token && { Authorization: `Bearer ${token}` }) };
      let reply;
      try {
        reply = await fetch(path, { ...options, headers });
      } catch {
        throw new NotNow("The service does not answer; trying again …");
      }
      if (reply.ok) return reply;
      const problem = await reply.json().catch(() => ({ detail: `${reply.status} ${reply.statusText}` }));
      if (reply.status === 401) {
        sessionStorage.setItem(TOKEN_KEY, await this.#askToken(problem.detail));
      } else if (reply.status === 503) {
        throw new NotNow(`Waiting: ${problem.detail} …`);
      } else {
        throw new ServiceError(problem.detail);
      }
    }
  }
}

function wait(ms) {
  return new Promise((resolve) => setTimeout(resolve, ms));
}
