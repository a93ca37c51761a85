// Figures over stated windows: frames in the trailing second, percentiles of the last latencies.

const SECOND_MS = 1000;
const LATENCIES = 200;

/** Frames in the trailing second. */
export class FrameRate {
  #times = [];

  count(nowMs) {
    this.#times.push(nowMs);
  }

  /** Frames that came in the second before `nowMs`. */
  rate(nowMs) {
    while (this.#times.length && this.#times[0] <= nowMs - SECOND_MS) this.#times.shift();
    return this.#times.length;
  }
}

/** The last latencies, one for each gaze that was seen in a frame. */
export class Latencies {
  #kept = [];

  add(latencyMs) {
    this.#kept.push(latencyMs);
    if (this.#kept.length > LATENCIES) this.#kept.shift();
  }

  clear() {
    this.#kept = [];
  }

  get count() {
    return this.#kept.length;
  }

  /** The latency that this share of the kept ones does not exceed [ms] (nearest rank); null where there is none. */
  percentile(share) {
    const sorted = [...this.#kept].sort((a, b) => a - b);
    return sorted.length ? sorted[Math.max(0, Math.ceil(share * sorted.length) - 1)] : null;
  }
}

/** Service's clock less this page's, from the quickest of the last round trips. */
export class ClockOffset {
  #trips = [];

  add(trip) {
    this.#trips.push(trip);
    if (this.#trips.length > 8) this.#trips.shift();
  }

  clear() {
    this.#trips = [];
  }

  /** {roundTripMs, offsetNs} of the quickest; null where there is none. */
  get best() {
    return this.#trips.reduce((best, trip) => (!best || trip.roundTripMs < best.roundTripMs ? trip : best), null);
  }
}
