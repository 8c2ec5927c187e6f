// Shading of points by the depth of their neighbours.
import {
  AlwaysDepth,
  DepthTexture,
  GLSL3,
  Mesh,
  NearestFilter,
  OrthographicCamera,
  PlaneGeometry,
  RawShaderMaterial,
  Scene,
  UnsignedIntType,
  Vector2,
  WebGLRenderTarget,
  type PerspectiveCamera,
  type WebGLRenderer,
} from "three";

const vertexShader = `
in vec3 position;
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`;

/** Eye-dome lighting after Boucheny: a pixel is dark where its neighbours are nearer. Depth is kept. */
const fragmentShader = `
precision highp float;
uniform sampler2D colours;
uniform highp sampler2D depths;
uniform vec2 range, radius;
uniform float strength;
out vec4 result;
float logDistance(ivec2 pixel) {
  float depth = texelFetch(depths, clamp(pixel, ivec2(0), textureSize(depths, 0) - 1), 0).r;
  return log2(range.x * range.y / (range.y - depth * (range.y - range.x)));
}
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float depth = texelFetch(depths, pixel, 0).r;
  vec3 colour = texelFetch(colours, pixel, 0).rgb;
  gl_FragDepth = depth;
  if (depth < 1.0) {
    float own = logDistance(pixel);
    ivec2 step = ivec2(max(radius, vec2(1.0)));
    float sum = 0.0;
    sum += max(0.0, own - logDistance(pixel + ivec2(step.x, 0)));
    sum += max(0.0, own - logDistance(pixel - ivec2(step.x, 0)));
    sum += max(0.0, own - logDistance(pixel + ivec2(0, step.y)));
    sum += max(0.0, own - logDistance(pixel - ivec2(0, step.y)));
    colour *= max(exp(-strength * sum), 0.4);
  }
  result = vec4(colour, 1.0);
}`;

export class EyeDome {
  private readonly target = new WebGLRenderTarget(1, 1, {
    minFilter: NearestFilter,
    magFilter: NearestFilter,
  });
  private readonly scene = new Scene();
  private readonly camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
  private readonly material: RawShaderMaterial;

  constructor() {
    this.target.depthTexture = new DepthTexture(1, 1, UnsignedIntType);
    this.material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader,
      fragmentShader,
      depthTest: true,
      depthWrite: true,
      uniforms: {
        colours: { value: this.target.texture },
        depths: { value: this.target.depthTexture },
        range: { value: new Vector2() },
        radius: { value: new Vector2(1, 1) },
        strength: { value: 1 },
      },
    });
    this.material.depthFunc = AlwaysDepth; // the depth of the points is the first of the frame
    const quad = new Mesh(new PlaneGeometry(2, 2), this.material);
    quad.frustumCulled = false;
    this.scene.add(quad);
  }

  resize(width: number, height: number, ratio: number): void {
    this.target.setSize(Math.max(1, width), Math.max(1, height));
    this.material.uniforms["radius"]!.value.set(ratio, ratio);
  }

  /** Points onto the canvas, shaded where there is strength; their depth is for what comes after. */
  render(
    renderer: WebGLRenderer,
    points: Scene,
    camera: PerspectiveCamera,
    strength: number,
  ): void {
    if (strength === 0) {
      renderer.render(points, camera);
      return;
    }
    const uniforms = this.material.uniforms;
    uniforms["range"]!.value.set(camera.near, camera.far);
    uniforms["strength"]!.value = strength;
    renderer.setRenderTarget(this.target);
    renderer.clear();
    renderer.render(points, camera);
    renderer.setRenderTarget(null);
    renderer.render(this.scene, this.camera);
  }
}
