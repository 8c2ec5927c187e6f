// Parts of the page that panes use.
import type { Commands } from "../data/commands";
import type { Source } from "../data/source";
import type { MapScene } from "../scene/map_scene";
import type { State } from "../state";

export interface App {
  state: State;
  source: Source;
  commands: Commands;
  /** Null where the browser has no WebGL. */
  scene: MapScene | null;
  /** Fetches the map again and shows it. */
  reload: () => Promise<void>;
}
