// Playing of the animation: the time follows the clock, and each picture shows the time at which it is asked for.

export class Playback {
  #state;
  #onChange;
  #frame = 0;

  /** `onChange` is called with true when it plays and false when it stops. */
  constructor(state, onChange) {
    this.#state = state;
    this.#onChange = onChange;
  }

  get isPlaying() {
    return this.#frame !== 0;
  }

  /** Plays a clip of so many seconds in a loop, or stops. */
  toggle(seconds) {
    if (this.isPlaying || !(seconds > 0)) {
      this.stop();
      return;
    }
    const { time } = this.#state.view;
    const begin = performance.now() - 1000 * (time < seconds ? time : 0);
    const step = now => {
      this.#frame = requestAnimationFrame(step);
      const at = (Math.max(0, now - begin) / 1000) % seconds;
      this.#state.change({ time: Number(at.toFixed(3)) }, true);
    };
    this.#frame = requestAnimationFrame(step);
    this.#onChange(true);
  }

  stop() {
    if (!this.isPlaying) return;
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    this.#onChange(false);
  }
}
