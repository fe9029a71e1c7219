/** The WebGL renderer. Without WebGL a message takes its place, and the rest of the page works. */
import { type Camera, PCFShadowMap, type Scene, ShaderMaterial, SRGBColorSpace, WebGLRenderer, WebGLRenderTarget } from 'three';
import { FullScreenQuad } from 'three/addons/postprocessing/Pass.js';
import { el } from '../ui/elements';
import type { Detail } from './detail';

/** The part of a renderer that the stage uses. */
export interface Renderer {
  readonly domElement: HTMLCanvasElement;
  readonly info: { readonly render: { calls: number; triangles: number } };
  /** Whether a program draws instead of a graphics card. */
  readonly software: boolean;
  render(scene: Scene, camera: Camera): void;
  /** Sets the size of the view, CSS px. */
  setSize(width: number, height: number): void;
  setDetail(detail: Detail): void;
  dispose(): void;
}

/** A canvas cannot change its antialiasing later: it has none, and a render target has it instead. */
const CONTEXT = { alpha: false, depth: true, stencil: false, antialias: false, premultipliedAlpha: true } as const;
/** Names of programs that draw without a graphics card. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** Appends a canvas to `place` and renders into it. */
export function createRenderer(place: HTMLElement): Renderer {
  const canvas = el('canvas', { tabindex: 0, role: 'img', 'aria-label': '3D view. Arrow keys turn the camera, plus and minus zoom.' });
  // three.js uses the canvas's existing context, and throws where the browser has none.
  const context = canvas.getContext('webgl2', CONTEXT) as WebGL2RenderingContext | null;
  if (context === null) return noRenderer(place, canvas);
  place.append(canvas);
  return new WebGL(canvas, context);
}

class WebGL implements Renderer {
  readonly software: boolean;
  private readonly three: WebGLRenderer;
  /** Smooths edges: the scene is drawn into it, then it is copied to the canvas. */
  private smooth: WebGLRenderTarget | null = null;
  private readonly copy = new ShaderMaterial({
    uniforms: { image: { value: null } },
    vertexShader: 'varying vec2 at; void main() { at = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }',
    fragmentShader:
      'uniform sampler2D image; varying vec2 at; void main() { gl_FragColor = texture2D(image, at);\n#include <colorspace_fragment>\n}',
    depthTest: false,
    depthWrite: false,
    toneMapped: false,
  });
  private readonly quad = new FullScreenQuad(this.copy);

  constructor(
    readonly domElement: HTMLCanvasElement,
    context: WebGL2RenderingContext,
  ) {
    const named = context.getExtension('WEBGL_debug_renderer_info');
    this.software = SOFTWARE.test(String(context.getParameter(named?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER)));
    this.three = new WebGLRenderer({ canvas: domElement, context });
    this.three.shadowMap.enabled = true;
    this.three.shadowMap.type = PCFShadowMap;
    // The counts are those of the scene, without the copy.
    this.three.info.autoReset = false;
  }

  get info(): Renderer['info'] {
    return this.three.info;
  }

  render(scene: Scene, camera: Camera): void {
    const { three, smooth } = this;
    three.info.reset();
    three.setRenderTarget(smooth);
    three.render(scene, camera);
    if (!smooth) return;
    three.setRenderTarget(null);
    this.quad.render(three);
  }

  setSize(width: number, height: number): void {
    this.three.setSize(width, height, false);
    this.smooth?.setSize(this.domElement.width, this.domElement.height);
  }

  setDetail({ samples, scale }: Detail): void {
    this.three.setPixelRatio(Math.min(window.devicePixelRatio, scale));
    this.smooth?.dispose();
    this.smooth =
      samples === 0 ? null : new WebGLRenderTarget(this.domElement.width, this.domElement.height, { samples, colorSpace: SRGBColorSpace });
    if (this.copy.uniforms['image']) this.copy.uniforms['image'].value = this.smooth?.texture ?? null;
  }

  dispose(): void {
    this.smooth?.dispose();
    this.copy.dispose();
    this.quad.dispose();
    this.three.dispose();
    this.domElement.remove();
  }
}

function noRenderer(place: HTMLElement, canvas: HTMLCanvasElement): Renderer {
  const sentence = el(
    'p',
    { class: 'no-picture' },
    el('span', { class: 'card' }, 'This browser has no WebGL, so this page cannot show the 3D view. Everything else works.'),
  );
  canvas.hidden = true;
  place.append(sentence, canvas);
  const nothing = (): void => undefined;
  return {
    domElement: canvas,
    software: false,
    render: nothing,
    setSize: nothing,
    setDetail: nothing,
    dispose: () => {
      sentence.remove();
      canvas.remove();
    },
    info: { render: { calls: 0, triangles: 0 } },
  };
}
