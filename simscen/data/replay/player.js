// Player: the shown time, and its progress while the run plays.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];

/** Time from 0 to `end` in simulated seconds. `changed` is called whenever it changes. */
export class Player {
  constructor(end, changed) {
    this.end = end;
    this.changed = changed;
    this.time = 0;
    this.speed = 1;
    this.playing = false;
  }

  seek(seconds) {
    this.time = Math.min(Math.max(seconds, 0), this.end);
    this.changed();
  }

  toggle() {
    if (this.playing) return this.pause();
    if (this.time >= this.end) this.time = 0;
    this.playing = true;
    let before = null;
    const go = (now) => {
      if (!this.playing) return;
      if (before !== null) this.time = Math.min(this.time + ((now - before) / 1000) * this.speed, this.end);
      before = now;
      if (this.time >= this.end) this.playing = false;
      this.changed();
      if (this.playing) requestAnimationFrame(go);
    };
    requestAnimationFrame(go);
    this.changed();
  }

  pause() {
    this.playing = false;
    this.changed();
  }

  /** Select the next faster (1) or slower (-1) speed. */
  pace(step) {
    this.speed = SPEEDS[Math.min(Math.max(SPEEDS.indexOf(this.speed) + step, 0), SPEEDS.length - 1)];
    this.changed();
  }
}
