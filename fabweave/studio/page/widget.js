import { unpacked } from "./message.js";
import { Scene } from "./scene.js";

/**
 * Show the object of a notebook's model; return what ends that.
 *
 * @param {{ model: any, el: HTMLElement }} view
 */
export function render({ model, el }) {
  const canvas = document.createElement("canvas");
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "The woven object");
  canvas.style.cssText = "display:block;width:100%;height:440px;touch-action:none;cursor:grab";
  el.append(canvas);
  const scene = Scene.on(canvas, {
    tapped(hit) {
      model.set("rung", hit?.rung ?? -1);
      model.save_changes();
    },
    arrowAt() {},
  });
  if (!scene) {
    canvas.replaceWith("This browser shows no WebGL 2.");
    return undefined;
  }
  const show = () => {
    const { buffer, byteOffset, byteLength } = model.get("data");
    scene.show(unpacked(buffer.slice(byteOffset, byteOffset + byteLength))[1]);
    scene.choose(model.get("chosen"));
  };
  show();
  model.on("change:data", show);
  model.on("change:chosen", () => scene.choose(model.get("chosen")));
  return () => {
    model.off("change:data", show);
    scene.dispose();
  };
}
