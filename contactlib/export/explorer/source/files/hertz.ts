// Hertz's ellipse from the radii of the two surfaces, as contactlib's EllipticContact has it.

// Complete elliptic integral of cos^2 t/sqrt(cos^2 t + k^2 sin^2 t) over t from 0 to pi/2, k > 0.
// Bulirsch, "Numerical calculation of elliptic integrals and elliptic functions III", Numerische
// Mathematik 13 (1969) 305-315, his cel(k, 1, 1, 0): arithmetic-geometric means of positive
// numbers, so no digits are lost in a circle or a long ellipse.
function cosineIntegral(k: number): number {
  let product = k, mean = 1, root = k;
  let [p, a, b] = [1, 1, 0];
  // Every step doubles the digits: these are enough for any k, and the loop ends for NaN too.
  for (let step = 0; step < 20; step++) {
    const [previousA, share, previousMean] = [a, product / p, mean];
    a += b / p;
    b = 2 * (b + previousA * share);
    p += share;
    mean += root;
    if (Math.abs(previousMean - root) <= 1e-8 * previousMean) break; // its square is beyond rounding
    root = 2 * Math.sqrt(product);
    product = root * mean;
  }
  return ((Math.PI / 2) * (b + a * mean)) / (mean * (mean + p));
}

/** Carlson's R_D(0, y, z) [1/(unit of y)^(3/2)]. */
function completeRD(y: number, z: number): number {
  return (3 * cosineIntegral(Math.sqrt(z / y))) / (z * Math.sqrt(y));
}

/**
 * Semi-axes a along and b across rolling [m] of the contact of two surfaces with the relative radii
 * R_x and R_y [m] under a load [N], with the contact modulus E* [Pa].
 *
 * 1/R_x = P R_D(0, b^2, a^2)/(pi E*) and 1/R_y = P R_D(0, a^2, b^2)/(pi E*).
 */
export function semiAxes(
  radiusX: number, radiusY: number, normalLoad: number, contactModulus: number,
): [number, number] {
  const logRadii = Math.log(radiusY) - Math.log(radiusX);
  // ln(R_y/R_x) rises with ln(b/a), which is between 1/2 and 2/3 of it.
  let high = 0.7 * Math.abs(logRadii) + 1e-3;
  let low = -high;
  for (let middle = 0; middle !== low && middle !== high; ) {
    const g = Math.exp(middle);
    const excess = Math.log(completeRD(g, 1 / g) / completeRD(1 / g, g)) - logRadii;
    if (excess < 0) low = middle;
    else high = middle;
    middle = 0.5 * (low + high);
  }
  const g = Math.exp(low);
  const compliance = normalLoad / (Math.PI * contactModulus);
  const mean = Math.cbrt(compliance * radiusX * completeRD(g, 1 / g));
  return [mean / Math.sqrt(g), mean * Math.sqrt(g)];
}
