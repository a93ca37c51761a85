// Numbers for people.

/** A time [ms], as "40 ms" or "1.2 s". */
function timeText(ms) {
  return ms < 1000 ? `${Number(ms.toPrecision(3))} ms` : `${Number((ms / 1000).toPrecision(3))} s`;
}

/** A loss with three digits, as 0.0123 or 1.2e-5. */
function lossText(loss) {
  return loss !== 0 && loss < 1e-4 ? loss.toExponential(1) : String(Number(loss.toPrecision(3)));
}

/** The places of 1, 2 and 5 times each power of ten from `low` to `high`, fewer if there are many. */
function logTicks(low, high) {
  const steps = high / low > 300 ? [1] : high / low > 30 ? [1, 3] : [1, 2, 5];
  const ticks = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += 1) {
    for (const step of steps) {
      const value = step * 10 ** power;
      if (value >= low && value <= high) ticks.push(value);
    }
  }
  return ticks;
}
