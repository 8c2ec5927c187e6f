// Drawing of points: colour, size, clipping and fading on the graphics card.
import {
  Color,
  DataTexture,
  GLSL3,
  NearestFilter,
  RawShaderMaterial,
  RGBAFormat,
  UnsignedByteType,
  Vector2,
  Vector3,
  Vector4,
} from "three";
import { rampAt } from "../palette";

export const roles = {
  static: 0,
  removed: 1,
  changes: 2,
  false_static: 3,
  false_dynamic: 4,
  keyframe: 5,
} as const;
export type Role = keyof typeof roles;
export const colourModes = { session: 0, height: 1, visits: 2, epoch: 3, intensity: 4 } as const;

const vertexShader = `
precision highp float;
in vec4 position;
in float intensity;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
uniform highp sampler2D sessions, epochs, ramp;
uniform int role, mode;
uniform float spacing, pixelsPerUnit, sizeFactor, smallest, largest, visits, lowest;
uniform vec2 heights;
uniform vec4 kinds[4];
uniform vec3 plain, boxLow, boxHigh;
uniform float onlySession;
out vec3 colour;
flat out float size;
void main() {
  int kind = int(position.w / 256.0);
  int session = onlySession >= 0.0 ? int(onlySession) : int(position.w) - 256 * kind;
  vec4 place = modelMatrix * vec4(position.xyz, 1.0);
  vec4 eye = viewMatrix * place;
  gl_Position = projectionMatrix * eye;
  vec4 own = texelFetch(sessions, ivec2(session, 0), 0);
  bool kept = own.a > 0.5 && all(greaterThanEqual(place.xyz, boxLow)) && all(lessThanEqual(place.xyz, boxHigh));
  bool removal = role == 1 || role == 2 || (role == 5 && kind > 0);
  float height = clamp((place.z - heights.x) / max(heights.y - heights.x, 0.1), 0.0, 1.0);
  colour = own.rgb * mix(lowest, 1.0, sqrt(height));
  if (mode == 1) colour = texture(ramp, vec2(height, 0.5)).rgb;
  if (mode == 2 && role == 0) colour = texture(ramp, vec2((float(kind) - 1.0) / max(visits - 1.0, 1.0), 0.5)).rgb;
  if (mode == 3) colour = texelFetch(epochs, ivec2(session, 0), 0).rgb;
  if (mode == 4 && role == 0)
    colour = intensity > 0.0 ? texture(ramp, vec2(sqrt(intensity), 0.5)).rgb : vec3(0.4);
  if (removal) {
    vec4 chosen = kinds[min(kind, 3)];
    colour = chosen.rgb;
    kept = kept && chosen.a > 0.5;
  }
  if (role == 3 || role == 4) colour = plain;
  if (!kept) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  size = gl_PointSize = clamp(spacing * sizeFactor * pixelsPerUnit / max(-eye.z, 0.01), smallest, largest);
}`;

/** Fading leaves points out by a fixed pattern: without sorting, and depth stays right. */
const fragmentShader = `
precision mediump float;
in vec3 colour;
flat in float size;
uniform float opacity, divider;
out vec4 result;
const float pattern[16] = float[](0.,8.,2.,10.,12.,4.,14.,6.,3.,11.,1.,9.,15.,7.,13.,5.);
void main() {
  if (gl_FragCoord.x > divider) discard;
  vec2 offset = gl_PointCoord - 0.5;
  if (size > 3.0 && dot(offset, offset) > 0.25) discard;
  if (opacity < 1.0) {
    ivec2 cell = ivec2(gl_FragCoord.xy) & 3;
    if ((pattern[cell.x + 4 * cell.y] + 0.5) / 16.0 > opacity) discard;
  }
  result = vec4(colour, 1.0);
}`;

function texture(width: number): DataTexture {
  const made = new DataTexture(new Uint8Array(4 * width), width, 1, RGBAFormat, UnsignedByteType);
  made.minFilter = made.magFilter = NearestFilter;
  return made;
}

function rampTexture(): DataTexture {
  const made = texture(256);
  const data = made.image.data as Uint8Array;
  for (let i = 0; i < 256; ++i) data.set([...rampAt(i / 255), 255], 4 * i);
  made.needsUpdate = true;
  return made;
}

/** Uniforms that all materials of a view share. */
export class PointUniforms {
  readonly sessions = texture(256);
  readonly epochs = texture(256);
  readonly shared = {
    sessions: { value: this.sessions },
    epochs: { value: this.epochs },
    ramp: { value: rampTexture() },
    mode: { value: 0 },
    pixelsPerUnit: { value: 1 },
    sizeFactor: { value: 1 },
    smallest: { value: 1 },
    largest: { value: 8 },
    visits: { value: 2 },
    /** Brightness of the lowest points in colours of sessions. */
    lowest: { value: 0.62 },
    heights: { value: new Vector2(0, 10) },
    boxLow: { value: new Vector3(-1e9, -1e9, -1e9) },
    boxHigh: { value: new Vector3(1e9, 1e9, 1e9) },
  };

  setSession(
    index: number,
    colour: [number, number, number],
    shown: boolean,
    epoch: [number, number, number],
  ): void {
    (this.sessions.image.data as Uint8Array).set([...colour, shown ? 255 : 0], 4 * index);
    (this.epochs.image.data as Uint8Array).set([...epoch, 255], 4 * index);
    this.sessions.needsUpdate = this.epochs.needsUpdate = true;
  }
}

export class PointMaterial extends RawShaderMaterial {
  constructor(uniforms: PointUniforms, role: Role) {
    super({
      glslVersion: GLSL3,
      vertexShader,
      fragmentShader,
      uniforms: {
        ...uniforms.shared,
        role: { value: roles[role] },
        spacing: { value: 0.1 },
        opacity: { value: 1 },
        divider: { value: 1e9 },
        kinds: { value: [0, 1, 2, 3].map(() => new Vector4(1, 1, 1, 1)) },
        plain: { value: new Color(1, 0, 0) },
        onlySession: { value: -1 },
      },
    });
  }

  set(name: "opacity" | "divider" | "spacing" | "onlySession", value: number): void {
    this.uniforms[name]!.value = value;
  }

  setKind(kind: number, [red, green, blue]: [number, number, number], shown: boolean): void {
    (this.uniforms["kinds"]!.value as Vector4[])[kind]!.set(
      red / 255,
      green / 255,
      blue / 255,
      shown ? 1 : 0,
    );
  }

  setPlain([red, green, blue]: [number, number, number]): void {
    (this.uniforms["plain"]!.value as Color).setRGB(red / 255, green / 255, blue / 255);
  }
}
