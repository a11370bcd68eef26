// Shows the newest frame on the canvas. A frame of fewer pixels than the stage is stretched: that is what adaptive
// resolution looks like. While one is being decoded, those in between are dropped.

export function frameShower(canvas, shown) {
  const draw = canvas.getContext('2d', {alpha: false});
  let busy = false, next = null;

  async function show(header, jpeg) {
    if (busy) return void (next = [header, jpeg]);
    busy = true;
    try {
      const image = await createImageBitmap(jpeg);
      const [width, height] = header.full;
      if (canvas.width !== width || canvas.height !== height) canvas.width = width, canvas.height = height;
      draw.imageSmoothingEnabled = image.width !== width;
      draw.drawImage(image, 0, 0, width, height);
      image.close();
      shown(header);
    } catch {
      // A frame that cannot be read is one frame fewer.
    }
    busy = false;
    if (next) {
      const [h, j] = next;
      next = null;
      show(h, j);
    }
  }
  return show;
}

// Frames a second over the last two seconds.
export function rateMeter() {
  const times = [];
  return {
    add: () => times.push(performance.now()),
    rate() {
      const now = performance.now();
      while (times.length && now - times[0] > 2000) times.shift();
      return times.length < 2 ? 0 : (1000 * (times.length - 1)) / Math.max(1, times.at(-1) - times[0]);
    },
  };
}
