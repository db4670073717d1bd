// Foldings: paths without loads, along the share of their way.
import { Path } from "./path.js";

export class Folding extends Path {
  factor = "share of the way";
  dashed = "";
}
