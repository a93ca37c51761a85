// The picture on the window: one pixel of the frame is one pixel of the screen wherever it fits.

/** Where the picture lies in the window, and how the window's points become the display's pixels. */
export class Stage {
  #stage;
  #frame;
  #onResize;
  #window = null; // {width_px, height_px, ratio}: the view in device pixels, and how many are a CSS pixel
  #asked = null;
  #inForce = null;
  #size = null;
  #place = { left: 0, top: 0, scale: 1 };

  /**
   * @param view     element that fills the window, from its top left corner
   * @param stage    element in it that holds the canvases
   * @param frame    canvas for the frames
   * @param onResize called when the view has another size, the first time too
   */
  constructor({ view, stage, frame, onResize }) {
    this.#stage = stage;
    this.#frame = frame.getContext("2d", { alpha: false });
    this.#onResize = onResize;
    new ResizeObserver(([entry]) => this.#measure(entry)).observe(view);
  }

  /** Size to ask frames for [px]: `asked`, or the window's own where that is null. */
  displaySize(asked) {
    this.#asked = asked;
    return asked ?? { width_px: this.#window.width_px, height_px: this.#window.height_px };
  }

  get measured() {
    return this.#window !== null;
  }

  /** Device pixels to a CSS pixel. */
  get ratio() {
    return this.#window.ratio;
  }

  /** Size of the frame that is shown [px]; null before the first. */
  get size() {
    return this.#size;
  }

  /** Screen pixels to a pixel of a frame of this size: 1, or less where the window is too small for it. */
  scaleOf({ width_px, height_px }) {
    return Math.min(1, this.#window.width_px / width_px, this.#window.height_px / height_px);
  }

  /** The display that gaze is told for, once the service has answered [px]. */
  set display(size) {
    this.#inForce = size;
  }

  /** Draw a frame. */
  show(picture) {
    const canvas = this.#frame.canvas;
    if (canvas.width !== picture.width || canvas.height !== picture.height) {
      canvas.width = picture.width;
      canvas.height = picture.height;
      this.#size = { width_px: picture.width, height_px: picture.height };
      this.#lay();
    }
    this.#frame.drawImage(picture, 0, 0);
    picture.close();
  }

  /** A point of the window [CSS px] as shares of the display's width and height. */
  toDisplay(clientX, clientY) {
    const size = this.#inForce ?? this.#asked ?? this.#window;
    const { left, top, scale } = this.#layOf(size);
    return {
      x: (clientX * this.ratio - left) / (scale * size.width_px),
      y: (clientY * this.ratio - top) / (scale * size.height_px),
    };
  }

  /** Shares of the display's width and height as a point of the window [CSS px]. */
  toWindow({ x, y }) {
    const size = this.#inForce ?? this.#asked ?? this.#window;
    const { left, top, scale } = this.#layOf(size);
    return {
      x: (left + x * scale * size.width_px) / this.ratio,
      y: (top + y * scale * size.height_px) / this.ratio,
    };
  }

  #measure(entry) {
    const css = entry.contentBoxSize[0];
    const device = entry.devicePixelContentBoxSize?.[0];
    this.#window = {
      width_px: pixels(css.inlineSize, device?.inlineSize),
      height_px: pixels(css.blockSize, device?.blockSize),
      ratio: devicePixelRatio,
    };
    this.#lay();
    this.#onResize();
  }

  #lay() {
    if (!this.#size || !this.#window) return;
    this.#place = this.#layOf(this.#size);
    const { left, top, scale } = this.#place;
    const css = (devicePx) => `${devicePx / this.ratio}px`;
    Object.assign(this.#stage.style, {
      left: css(left),
      top: css(top),
      width: css(this.#size.width_px * scale),
      height: css(this.#size.height_px * scale),
    });
    this.#stage.classList.toggle("reduced", scale < 1);
  }

  #layOf(size) {
    const scale = this.scaleOf(size);
    const centred = (room, side) => Math.floor((room - side * scale) / 2);
    return {
      left: centred(this.#window.width_px, size.width_px),
      top: centred(this.#window.height_px, size.height_px),
      scale,
    };
  }
}

/** A length in device pixels; the browser's own rounding where it tells it, which it does not for an emulated ratio. */
function pixels(css, device) {
  const scaled = css * devicePixelRatio;
  return Math.max(1, Math.abs(device - scaled) <= 1 ? device : Math.round(scaled));
}
