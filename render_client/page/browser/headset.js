// A headset (WebXR): both eyes are drawn by the same program as the page, and a controller is a hand.
'use strict';

let headset = null;  // while one is worn: { session, layer, room, framebuffer, leads }
const wears_headset = () => headset !== null;

const BUZZ_MS = 30;

// Framebuffers that the browser has made get a number by which the program knows them.
function number_of(framebuffer) {
  if (!framebuffer) return 0;
  const table = program.GL.framebuffers;
  const number = program.GL.getNewId(table);
  table[number] = framebuffer;
  framebuffer.name = number;
  return number;
}

async function put_on() {
  if (!state?.session || headset) return;
  const session = await navigator.xr.requestSession('immersive-vr');
  const context = canvas.getContext('webgl2');
  await context.makeXRCompatible?.();
  const layer = new XRWebGLLayer(session, context);
  session.updateRenderState({ baseLayer: layer, depthNear: 0.05, depthFar: 20 });
  const room = await session.requestReferenceSpace('local');
  headset = { session, layer, room, framebuffer: number_of(layer.framebuffer), leads: null };
  session.addEventListener('end', take_off);
  session.addEventListener('selectstart', (event) => take_in_hand(event.inputSource));
  call('headset', 1);
  session.requestAnimationFrame(look);
}

function take_off() {
  if (headset.framebuffer) program.GL.framebuffers[headset.framebuffer] = null;
  headset = null;
  call('headset', 0);
  call('resize', ...pixel_size());
}

// The controller whose trigger was pulled last leads. An empty hand takes the first instrument that is free.
function take_in_hand(source) {
  headset.leads = source;
  if (!state || holds() || !state.people.find((p) => p.id === state.you)?.may_write) return;
  const free = state.tools.findIndex((tool) => tool.holder === 0);
  if (free >= 0) claim(free, 'claim');
}

function push_controller(frame) {
  const sources = [...headset.session.inputSources].filter((s) => s.gripSpace);
  const source = sources.find((s) => s === headset.leads) ?? sources.find((s) => s.handedness === 'right') ?? sources[0];
  const grip = source && frame.getPose(source.gripSpace, headset.room);
  if (!grip) return;
  const { position: p, orientation: q } = grip.transform;
  const pulled = (i) => source.gamepad?.buttons[i]?.value ?? 0;  // in the standard mapping: 0 the trigger, 1 the grip
  call('controller', p.x, p.y, p.z, q.x, q.y, q.z, q.w, pulled(0), pulled(1) > 0.5 ? 1 : 0);
  const force_n = holds() ? state.tools[state.held].force_n : 0;
  if (force_n > 0) source.gamepad?.hapticActuators?.[0]?.pulse(Math.min(1, force_n / FULL_FORCE_N), BUZZ_MS);
}

function look(_, frame) {
  if (!headset) return;
  headset.session.requestAnimationFrame(look);
  push_controller(frame);
  tick(true);
  const seen = frame.getViewerPose(headset.room);
  for (const view of seen?.views ?? []) {
    const part = headset.layer.getViewport(view);
    const at = call('eye') / Float32Array.BYTES_PER_ELEMENT;
    program.HEAPF32.set(view.transform.inverse.matrix, at);
    program.HEAPF32.set(view.projectionMatrix, at + 16);
    call('draw_eye', headset.framebuffer, part.x, part.y, part.width, part.height);
  }
}

async function offer_headset() {
  byId('headset').hidden = !(await navigator.xr?.isSessionSupported('immersive-vr').catch(() => false));
}
byId('headset').onclick = () => put_on().catch((error) => {
  byId('headset').textContent = 'Headset: ' + error.message;
});
navigator.xr?.addEventListener?.('devicechange', offer_headset);
offer_headset();
