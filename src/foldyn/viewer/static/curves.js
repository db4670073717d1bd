// Curves over the samples of a result.

// Value of a curve over the samples of a result at a moment.
export function at(result, values, moment) {
  const [k, part] = result.place(moment);
  return between(values, k + part);
}

// Value at a place between samples, such as 3.5.
export function between(values, place) {
  const k = Math.min(Math.floor(place), values.length - 1);
  return values[k] + (place - k) * (values[Math.min(k + 1, values.length - 1)] - values[k]);
}

// The largest size of values.
export const greatest = (values) => values.reduce((top, value) => Math.max(top, Math.abs(value)), 0);

export function evenly(moments) {
  const dt = (moments.at(-1) - moments[0]) / (moments.length - 1);
  return moments.every((value, k) => Math.abs(value - moments[0] - k * dt) < 1e-3 * dt);
}

// Where a spectrum has fallen to a hundredth of its largest for good.
export function lastOfInterest({ x, y }) {
  const top = greatest(y);
  let k = y.length - 1;
  while (k > 8 && y[k] < 0.01 * top) k--;
  return 1.15 * x[k];
}

export function cut(curve, most) {
  const count = Math.max(2, curve.x.findIndex((value) => value > most) + 1 || curve.x.length);
  return { ...curve, x: curve.x.slice(0, count), y: curve.y.slice(0, count) };
}
