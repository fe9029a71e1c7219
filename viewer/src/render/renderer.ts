/** What draws; where the browser has no WebGL, something that does not: a sentence says so, and the rest of the page goes on. */
import { PCFShadowMap, WebGLRenderer } from 'three';
import { el } from '../ui/elements';

/** What the stage needs of a renderer. */
export type Renderer = Pick<WebGLRenderer, 'domElement' | 'render' | 'setSize' | 'setPixelRatio' | 'dispose'> & { readonly info: { readonly render: { calls: number; triangles: number } } };

/** As three.js asks for it. */
const CONTEXT = { alpha: true, depth: true, stencil: false, antialias: true, premultipliedAlpha: true } as const;

/** Draws into a canvas that it appends to a place. */
export function createRenderer(place: HTMLElement): Renderer {
  const canvas = el('canvas', { tabindex: 0, role: 'img', 'aria-label': 'The world in three dimensions. Arrow keys turn the camera, plus and minus zoom.' });
  // three.js takes the context that a canvas has already; where there is none it would fail.
  if (canvas.getContext('webgl2', CONTEXT) === null) return blank(place, canvas);
  const renderer = new WebGLRenderer({ canvas, antialias: true });
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = PCFShadowMap;
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  place.append(canvas);
  return renderer;
}

function blank(place: HTMLElement, canvas: HTMLCanvasElement): Renderer {
  const sentence = el('p', { class: 'no-picture' }, el('span', { class: 'card' },
    'This browser has no WebGL, so the picture in three dimensions is missing; everything else on this page works.'));
  canvas.hidden = true;
  place.append(sentence, canvas);
  const nothing = (): void => undefined;
  return { domElement: canvas, render: nothing, setSize: nothing, setPixelRatio: nothing, dispose: () => { sentence.remove(); }, info: { render: { calls: 0, triangles: 0 } } };
}
