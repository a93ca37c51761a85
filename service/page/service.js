// What the page asks over plain HTTP: scenes, drawings of cells, and which choices the service offers.

const TOKEN_KEY = "gazetrace-token";
const RETRY_MS = 1000;

/** What the service answers when it refuses, in one line fit to show; `field` names what to change, if it knows. */
export class ServiceError extends Error {
  constructor(message, field = null) {
    super(message);
    this.field = field;
  }
}

/** The service's token, kept for this tab; asked for once at a time, however many requests were refused. */
export class Token {
  #ask;
  #asked = null;

  /** @param ask is called with a reason and resolves to a token */
  constructor(ask) {
    this.#ask = ask;
  }

  get value() {
    return sessionStorage.getItem(TOKEN_KEY);
  }

  /** Ask for another one than `refused`; resolves once it is there. */
  async renew(why, refused) {
    if (this.value !== refused) return;
    this.#asked ??= this.#ask(why).then((token) => {
      sessionStorage.setItem(TOKEN_KEY, token);
      this.#asked = null;
    });
    await this.#asked;
  }
}

/** Requests to the service that serves this page. */
export class Service {
  #token;

  constructor(token) {
    this.#token = token;
  }

  /** Ids of all scenes. */
  async sceneIds() {
    return (await this.#json("v1/scenes?details=false")).scenes.map(({ id }) => id);
  }

  /** A scene's title, size and effects; the service loads it where it has not yet. */
  scene(id) {
    return this.#json(`v1/scenes/${encodeURIComponent(id)}`);
  }

  /** What accuracy costs for a scene: {table}, or {progress} where it is being measured. */
  async accuracy(id) {
    const reply = await this.#fetch(`v1/scenes/${encodeURIComponent(id)}/accuracy`);
    return { [reply.status === 202 ? "progress" : "table"]: await reply.json() };
  }

  /** The fields of a request's quality, as JSON schema: which values this service knows. */
  async qualitySchema() {
    const { schemas } = (await this.#json("openapi.json")).components;
    return { quality: schemas.QualityBody.properties, acuity: schemas.AcuityBody.properties };
  }

  /** A small picture of a scene, as Blob. */
  thumbnail(id, width, height) {
    const query = { gaze_x: 0.5, gaze_y: 0.5, unit: "fraction", width_px: width, height_px: height, format: "jpeg" };
    return this.#blob(`v1/scenes/${encodeURIComponent(id)}/frame?${new URLSearchParams(query)}`);
  }

  /** The cells for a gaze, drawn over grey by what `query` names; an ImageBitmap. */
  async cells(query) {
    return createImageBitmap(await this.#blob(`v1/cellmap?${new URLSearchParams({ ...query, format: "png" })}`));
  }

  async #json(path) {
    return (await this.#fetch(path)).json();
  }

  async #blob(path) {
    return (await this.#fetch(path)).blob();
  }

  async #fetch(path) {
    for (;;) {
      const token = this.#token.value;
      const reply = await fetch(path, { headers: token ? { Authorization: `Bearer ${token}` } : {} }).catch(() => null);
      if (reply?.ok) return reply;
      const problem = (await reply?.json().catch(() => null)) ?? {};
      if (reply?.status === 401) {
        await this.#token.renew(problem.detail, token);
      } else if (!reply || reply.status === 503) {
        await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
      } else {
        throw new ServiceError(problem.detail ?? `${reply.status} ${reply.statusText}`, problem.errors?.[0]?.field);
      }
    }
  }
}
