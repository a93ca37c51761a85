// The WebSocket /v1/stream: what the page wants to see goes up, frames come down, and a lost connection comes back.

const SUBPROTOCOL = "gazetrace.v1";
const FIRST_RETRY_MS = 250;
const LONGEST_RETRY_MS = 5000;
const RETRY_JITTER = 0.2;
const PING_EVERY_MS = 4000;
const NS_PER_MS = 1e6;

// Close codes of service/protocol.py.
const PROTOCOL = 4400;
const TOKEN = 4401;
const ORIGIN = 4403;

/** A frame's bytes taken apart: its header, and its picture as a Blob. */
export function takeApart(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  return { header, image: new Blob([new Uint8Array(buffer, 4 + length)], { type: `image/${header.format}` }) };
}

/**
 * One viewer of one session.
 *
 * The page states what it wants to see; the stream sends what differs from what it sent before, one change at a time,
 * and all of it after a reconnect. A change of the view alone waits until a frame of the last one was seen, so that
 * turning the camera shows a picture for each step that is sent.
 */
export class Stream {
  #token;
  #on;
  #socket = null;
  #told = null; // the token
  #retryTimer = null;
  #failures = 0;
  #wanted = null;
  #sent = null;
  #refused = null;
  #lastId = Date.now(); // so that an earlier page's ids in the same session are not taken for this one's
  #unanswered = null;
  #current = null;
  #unseen = false;
  #gaze = null;
  #pings = new Map();
  #lastPing = 0;

  /**
   * @param token   the service's Token
   * @param session name of the session to join, null for a new one
   * @param on      callbacks: `state` ({name: connecting, lost, locked or refused; retryMs?, reason?}); `ready`
   *                (and whether it answers what this page asked last), `status`, `target` and `error`, as in service/protocol.py; `clock` ({roundTripMs, offsetNs: of the
   *                service's clock from performance.now()}); and `frame` ({header, picture: an ImageBitmap to close}),
   *                of the configuration in force alone
   */
  constructor({ token, session, on }) {
    this.#token = token;
    this.session = session;
    this.#on = on;
    setInterval(() => this.#ping(), PING_EVERY_MS);
    for (const event of ["online", "visibilitychange"]) {
      (event === "online" ? window : document).addEventListener(event, () => this.hurry());
    }
  }

  /** Keep a connection from now on. */
  start() {
    this.#connect();
  }

  /** State what to see: the fields of a render request without its gaze. */
  want(configuration) {
    this.#wanted = configuration;
    this.#refused = null;
    this.#sync();
  }

  /** Tell where the eye looks; only the newest matters, so nothing is kept while there is no connection. */
  look(gaze) {
    this.#gaze = gaze;
    if (this.#current !== null) this.#send({ type: "gaze", ...gaze });
  }

  /** Say no more where this page's pointer is, also not after a reconnect. */
  lookAway() {
    this.#gaze = null;
  }

  get connected() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  #connect() {
    clearTimeout(this.#retryTimer);
    this.#on.state({ name: "connecting" });
    const address = new URL("v1/stream", document.baseURI);
    address.protocol = address.protocol.replace("http", "ws");
    const socket = new WebSocket(address, SUBPROTOCOL);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#told = this.#token.value;
      this.#send({ type: "hello", ...(this.#told && { token: this.#told }), ...(this.session && { session: this.session }) });
      this.#ping();
      this.#sync();
    };
    socket.onmessage = ({ data }) => (typeof data === "string" ? this.#hear(JSON.parse(data)) : this.#receive(data));
    socket.onclose = (event) => this.#lose(event);
    this.#socket = socket;
  }

  async #lose({ code, reason }) {
    this.#socket = this.#sent = this.#unanswered = this.#current = null;
    this.#unseen = false;
    this.#pings.clear();
    if (code === TOKEN) {
      this.#on.state({ name: "locked" });
      await this.#token.renew(reason || "this service asks for its token", this.#told);
      this.#connect();
      return;
    }
    if (code === PROTOCOL || code === ORIGIN) {
      this.#on.state({ name: "refused", reason });
      return;
    }
    const jitter = 1 + RETRY_JITTER * (2 * Math.random() - 1);
    const retryMs = Math.min(FIRST_RETRY_MS * 2 ** this.#failures, LONGEST_RETRY_MS) * jitter;
    this.#failures += 1;
    this.#on.state({ name: "lost", retryMs, reason });
    this.#retryTimer = setTimeout(() => this.#connect(), retryMs);
  }

  /** Connect again now, where that is being waited for. */
  hurry() {
    if (!this.#socket && this.#retryTimer && !document.hidden) this.#connect();
  }

  #sync() {
    if (!this.#wanted || !this.connected || this.#wanted === this.#refused) return;
    const changed = this.#sent === null ? ["scene"] : changes(this.#sent, this.#wanted);
    const viewAlone = changed.every((field) => field === "camera" || field === "quality");
    if (!changed.length || (viewAlone && (this.#unanswered || this.#unseen))) return;
    const id = ++this.#lastId;
    const [field] = changed;
    if (viewAlone && changed.length === 1) {
      this.#send({ type: field, id, [field]: this.#wanted[field] });
    } else {
      const gaze = this.#gaze && { x: this.#gaze.x, y: this.#gaze.y, unit: this.#gaze.unit };
      this.#send({ type: "configure", id, ...this.#wanted, gaze });
    }
    this.#sent = this.#wanted;
    this.#unanswered = id;
    this.#unseen = true;
  }

  #hear(message) {
    switch (message.type) {
      case "ready":
        this.#failures = 0;
        this.session = message.session;
        this.#current = message.config;
        if (message.config === this.#unanswered) this.#unanswered = null;
        this.#on.ready(message, message.config === this.#lastId);
        this.#sync();
        break;
      case "error":
        if (this.#unanswered !== null) {
          this.#refused = this.#sent;
          this.#sent = this.#unanswered = null;
          this.#unseen = false;
        }
        this.#on.error(message);
        this.#sync();
        break;
      case "pong":
        this.#compareClocks(message);
        break;
      case "status":
      case "target":
        this.#on[message.type](message);
    }
  }

  async #receive(buffer) {
    const socket = this.#socket;
    const { header, image } = takeApart(buffer);
    try {
      const picture = header.config === this.#current ? await createImageBitmap(image) : null;
      if (picture && header.config === this.#current) {
        this.#on.frame({ header, picture });
        this.#unseen = false;
      } else {
        picture?.close();
      }
    } finally {
      await shown();
      if (socket === this.#socket) {
        this.#send({ type: "ack", frame: header.frame });
        this.#sync();
      }
    }
  }

  #ping() {
    if (!this.connected || this.#pings.size > 0) return;
    const now = performance.now();
    this.#pings.set(++this.#lastPing, now);
    this.#send({ type: "ping", id: this.#lastPing, client_time_ns: Math.round(now * NS_PER_MS) });
  }

  #compareClocks({ id, service_time_ns }) {
    const sentMs = this.#pings.get(id);
    if (sentMs === undefined) return;
    this.#pings.delete(id);
    const roundTripMs = performance.now() - sentMs;
    this.#on.clock({ roundTripMs, offsetNs: service_time_ns - (sentMs + roundTripMs / 2) * NS_PER_MS });
  }

  #send(message) {
    if (this.connected) this.#socket.send(JSON.stringify(message));
  }
}

function changes(before, after) {
  const fields = new Set([...Object.keys(before), ...Object.keys(after)]);
  return [...fields].filter((field) => JSON.stringify(before[field]) !== JSON.stringify(after[field]));
}

/** Resolves when the page can be seen: a hidden page asks for no further frames. */
async function shown() {
  while (document.hidden) {
    await new Promise((resolve) => document.addEventListener("visibilitychange", resolve, { once: true }));
  }
}
