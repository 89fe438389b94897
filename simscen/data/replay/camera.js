// Camera of a map: conversion of meters (y up) to pixels (y down) and back.

export const NEAREST = 2000, FURTHEST = 0.5;

/** Shows the point (x, y) in the middle, with `scale` pixels per meter. */
export class Camera {
  constructor(x = 0, y = 0, scale = 40) {
    this.x = x;
    this.y = y;
    this.scale = scale;
  }

  /** Return the pixel of a point on a canvas of the given size. */
  pixel(x, y, width, height) {
    return [width / 2 + (x - this.x) * this.scale, height / 2 - (y - this.y) * this.scale];
  }

  /** Return the point at a pixel. */
  point(u, v, width, height) {
    return [this.x + (u - width / 2) / this.scale, this.y - (v - height / 2) / this.scale];
  }

  /** Move the shown part by pixels. */
  pan(du, dv) {
    this.x -= du / this.scale;
    this.y += dv / this.scale;
  }

  /** Zoom in by a factor. The point at the pixel stays where it is. */
  zoom(factor, u, v, width, height) {
    const [x, y] = this.point(u, v, width, height);
    this.scale = Math.min(Math.max(this.scale * factor, FURTHEST), NEAREST);
    const [nu, nv] = this.pixel(x, y, width, height);
    this.pan(u - nu, v - nv);
  }

  /** Show the rectangle [x0, y0, x1, y1] with a margin in pixels. */
  fit([x0, y0, x1, y1], width, height, margin = 24) {
    this.x = (x0 + x1) / 2;
    this.y = (y0 + y1) / 2;
    const across = Math.max(width - 2 * margin, 40) / Math.max(x1 - x0, 0.1);
    const along = Math.max(height - 2 * margin, 40) / Math.max(y1 - y0, 0.1);
    this.scale = Math.min(Math.max(Math.min(across, along), FURTHEST), NEAREST);
  }
}

/** Return a round length (1, 2, or 5 times a power of ten) that is at most about `most` pixels long. */
export function roundLength(scale, most) {
  const power = 10 ** Math.floor(Math.log10(most / scale));
  return [5, 2, 1].map((times) => times * power).find((length) => length * scale <= most) ?? power;
}
