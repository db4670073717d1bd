// Kinds of results by their names.
import { Bands } from "./bands.js";
import { Folding } from "./folding.js";
import { Modes } from "./modes.js";
import { Motion } from "./motion.js";
import { Path } from "./path.js";
import { Periodic } from "./periodic.js";
import { FrequencyResponse } from "./response.js";
import { Shape } from "./shape.js";

export const ANALYSES = {
  motion: Motion, path: Path, folding: Folding, modes: Modes, response: FrequencyResponse, bands: Bands,
  periodic: Periodic, shape: Shape,
};
