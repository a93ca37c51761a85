// What the page says of itself: the state of the connection, what goes on, what is wrong, and the token it needs.

const COUNTDOWN_MS = 250;
const element = (id) => document.getElementById(id);

/** Connection, status line and error banner. */
export class Notices {
  #countdown = null;

  constructor() {
    element("banner").querySelector("button").addEventListener("click", () => this.settle());
  }

  /** Show the state of the connection: `live`, or one that a Stream tells. */
  connection({ name, retryMs, reason }) {
    clearInterval(this.#countdown);
    element("connection").dataset.state = name;
    if (name === "lost") {
      const until = performance.now() + retryMs;
      const tell = () => {
        const left = Math.max(0, until - performance.now()) / 1000;
        element("connection_told").textContent = `connection lost; again in ${left.toFixed(0)} s`;
      };
      this.#countdown = setInterval(tell, COUNTDOWN_MS);
      tell();
      this.status(reason ? `The service says: ${reason}` : "Waiting for the service …");
    } else {
      const told = { live: "live", connecting: "connecting", locked: "token needed", refused: "refused" }[name];
      element("connection_told").textContent = told;
      if (name === "refused") this.problem(`The service refuses this page: ${reason}. Reload the page to try again.`);
    }
  }

  /** Say what goes on; empty: nothing worth saying. */
  status(text) {
    element("status").textContent = text;
  }

  /** Say what is wrong, until it is settled. */
  problem(text) {
    element("banner").querySelector("span").textContent = text;
    element("banner").hidden = false;
  }

  /** What was wrong is not any more. */
  settle() {
    element("banner").hidden = true;
  }
}

/** Ask for the service's token; resolves to it. */
export function askToken(why) {
  return new Promise((resolve) => {
    const dialog = element("token");
    const field = dialog.querySelector("input");
    element("token_why").textContent = why;
    field.value = "";
    const stay = (event) => event.preventDefault();
    dialog.addEventListener("cancel", stay);
    dialog.addEventListener("close", () => {
      dialog.removeEventListener("cancel", stay);
      resolve(field.value);
    }, { once: true });
    dialog.showModal();
  });
}
