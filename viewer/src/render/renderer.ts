/** The WebGL renderer. Without WebGL a message takes its place, and the rest of the page works. */
import { PCFShadowMap, WebGLRenderer } from 'three';
import { el } from '../ui/elements';

/** The part of WebGLRenderer that the stage uses. */
export type Renderer = Pick<WebGLRenderer, 'domElement' | 'render' | 'setSize' | 'setPixelRatio' | 'dispose'> & { readonly info: { readonly render: { calls: number; triangles: number } } };

/** The context attributes that three.js would request. */
const CONTEXT = { alpha: true, depth: true, stencil: false, antialias: true, premultipliedAlpha: true } as const;

/** Appends a canvas to `place` and renders into it. */
export function createRenderer(place: HTMLElement): Renderer {
  const canvas = el('canvas', { tabindex: 0, role: 'img', 'aria-label': '3D view. Arrow keys turn the camera, plus and minus zoom.' });
  // three.js uses the canvas's existing context, and throws where the browser has none.
  if (canvas.getContext('webgl2', CONTEXT) === null) return noRenderer(place, canvas);
  const renderer = new WebGLRenderer({ canvas, antialias: true });
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = PCFShadowMap;
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  place.append(canvas);
  return renderer;
}

function noRenderer(place: HTMLElement, canvas: HTMLCanvasElement): Renderer {
  const sentence = el('p', { class: 'no-picture' }, el('span', { class: 'card' },
    'This browser has no WebGL, so this page cannot show the 3D view. Everything else works.'));
  canvas.hidden = true;
  place.append(sentence, canvas);
  const nothing = (): void => undefined;
  return { domElement: canvas, render: nothing, setSize: nothing, setPixelRatio: nothing, dispose: () => { sentence.remove(); }, info: { render: { calls: 0, triangles: 0 } } };
}
