// The connection to the renderer: one state in flight, the newest wins, and a new connection when the old one is lost.

/** Milliseconds after which an unanswered state no longer holds back the next one. */
const PATIENCE = 3000;
const FIRST_RETRY = 400;
const LAST_RETRY = 5000;

export class Connection {
  #url;
  #handlers;
  #socket = null;
  #serial = 0;
  #shown = 0;
  #sent = null;
  #waiting = null;
  #header = null;
  #retry = FIRST_RETRY;
  #picks = [];
  #timer = 0;

  /** `handlers` has functions of each message by its type, and opened() and lost(attempts). */
  constructor(url, handlers) {
    this.#url = url;
    this.#handlers = handlers;
    this.#open(0);
  }

  get isOpen() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  /** Returns true if a frame with this header shows the newest state. */
  isNewest(header) {
    return !this.#waiting && header.serial === this.#serial;
  }

  /** Sends a state, or keeps it until the one in flight is answered. Only the newest is kept. */
  send(state) {
    this.#waiting = state;
    this.#flush();
  }

  /** Requests the object at a pixel of the picture. */
  pick(x, y, then) {
    if (!this.isOpen) return;
    this.#flush(true);
    this.#picks.push(then);
    this.#post({ type: "pick", serial: this.#serial, x, y });
  }

  /** Requests another scene of the list, by its index. */
  openFile(file) {
    if (this.isOpen) this.#post({ type: "open", file });
  }

  #open(attempts) {
    const socket = new WebSocket(this.#url);
    this.#socket = socket;
    socket.binaryType = "blob";
    socket.onopen = () => {
      this.#retry = FIRST_RETRY;
      attempts = 0;
      this.#handlers.opened();
    };
    socket.onmessage = event => this.#receive(event.data);
    socket.onclose = () => {
      this.#sent = this.#header = null;
      this.#picks = [];
      this.#handlers.lost(attempts + 1);
      setTimeout(() => this.#open(attempts + 1), this.#retry);
      this.#retry = Math.min(LAST_RETRY, this.#retry * 1.6);
    };
  }

  #post(message) {
    this.#socket.send(JSON.stringify(message));
  }

  /** Sends the waiting state, unless a coarse frame is on its way. */
  #flush(now = false) {
    clearTimeout(this.#timer);
    const state = this.#waiting;
    if (!state || !this.isOpen) return;
    const waited = this.#sent ? performance.now() - this.#sent.time : Infinity;
    if (!now && this.#sent?.moving && waited < PATIENCE) {
      this.#timer = setTimeout(() => this.#flush(), PATIENCE - waited);
      return;
    }
    this.#waiting = null;
    this.#serial += 1;
    this.#sent = { moving: state.moving, time: performance.now() };
    this.#post({ type: "view", serial: this.#serial, ...state });
  }

  #receive(data) {
    if (typeof data !== "string") {
      const header = this.#header;
      this.#header = null;
      if (header) this.#receiveFrame(header, data);
      return;
    }
    const message = JSON.parse(data);
    switch (message.type) {
      case "frame":
        this.#header = message;
        break;
      case "picked":
        this.#picks.shift()?.(message);
        break;
      case "command":
        if (message.serial >= this.#serial) this.#handlers.command(message);
        break;
      case "error":
        this.#sent = null;
        this.#handlers.error(message);
        this.#flush();
        break;
      default:
        this.#handlers[message.type]?.(message);
    }
  }

  #receiveFrame(header, blob) {
    // While the camera moves, a late frame is better than none.
    const oldest = this.#sent?.moving || this.#waiting ? this.#shown : this.#serial;
    if (header.serial >= oldest) {
      this.#shown = header.serial;
      this.#handlers.frame(header, blob);
    }
    if (header.serial >= this.#serial) {
      this.#sent = null;
      this.#flush();
    }
  }
}
