// Colours of sessions and of kinds of points, as the settings say.
import { bytes, changeColour, errorColour, rampAt, removalColour, sessionColour } from "../palette";
import type { Settings, State } from "../state";
import { colourModes, type PointMaterial, type PointUniforms, type Role } from "./point_material";

/** Opacity of the map while the drive is shown up to a time. */
const backgroundOpacity = 0.2;
const fadedOpacity = 0.4;
/** Brightness of the lowest points in colours of sessions. */
const lowestBrightness = { dark: 0.62, light: 0.8 };
const mostSessions = 256;

export function colourSessions(uniforms: PointUniforms, state: State): void {
  const { settings, map } = state;
  const { shared } = uniforms;
  shared.lowest.value = lowestBrightness[settings.theme];
  shared.mode.value = colourModes[settings.colour];
  shared.visits.value = Math.max(2, map!.sessions.filter((_, index) => state.inMap(index)).length);
  const latest = Math.max(1, map!.epoch);
  for (let index = 0; index < mostSessions; ++index) {
    const epoch = rampAt((map!.sessions[index]?.epoch ?? 0) / latest);
    uniforms.setSession(
      index,
      bytes(sessionColour(index, settings.theme)),
      !settings.hiddenSessions.has(index),
      epoch,
    );
  }
}

export function colourKinds(
  materials: Record<Role, PointMaterial>,
  keyframes: PointMaterial[],
  settings: Settings,
): void {
  const { removed, changes } = materials;
  for (const material of [removed, ...keyframes])
    removalColour.forEach((colour, kind) =>
      material.setKind(
        kind,
        bytes(colour),
        settings.removedKinds[kind]! && (material === removed || settings.removed),
      ),
    );
  const shown = Object.values(settings.changeKinds);
  Object.values(changeColour).forEach((colour, kind) =>
    changes.setKind(kind, bytes(colour), shown[kind]!),
  );
  for (const name of ["false_static", "false_dynamic"] as const)
    materials[name].setPlain(bytes(errorColour[name]!));
  materials.static.set("opacity", settings.driveTime_s === null ? 1 : backgroundOpacity);
  removed.set("opacity", settings.faded ? fadedOpacity : 1);
}
