// The list of objects. Only the rows in view are elements, so that it stays fluid with many objects.

/** Rows above and below those in view. */
const OVERSCAN = 6;

export class ObjectList {
  #list;
  #rows;
  #search;
  #count;
  #showFound;
  #hideFound;
  #actions;
  #objects = [];
  #shown = [];
  /** Indices of hidden objects: as the view has them, and as a set. */
  #hiddenIndices = null;
  #hidden = new Set();
  #selected = null;
  /** Position of the active row in #shown. */
  #active = 0;
  #rowHeight = 28;

  /** `actions` are those of the page. */
  constructor({ list, search, count, showFound, hideFound }, actions) {
    this.#list = list;
    this.#rows = list.firstElementChild;
    this.#search = search;
    this.#count = count;
    this.#showFound = showFound;
    this.#hideFound = hideFound;
    this.#actions = actions;
    showFound.addEventListener("click", () => actions.showAll(this.#shown));
    hideFound.addEventListener("click", () => actions.hideAll(this.#shown));
    search.addEventListener("input", () => this.#filter());
    list.addEventListener("scroll", () => this.#draw());
    list.addEventListener("keydown", event => this.#press(event));
    list.addEventListener("click", event => this.#click(event));
    list.addEventListener("focus", () => this.#draw());
    list.addEventListener("blur", () => this.#draw());
    new ResizeObserver(() => this.#draw()).observe(list);
  }

  set objects(objects) {
    this.#objects = objects;
    this.#filter();
  }

  /** Shows which objects are hidden and selected. */
  update(hidden, selected) {
    if (hidden === this.#hiddenIndices && selected === this.#selected) return;
    if (hidden !== this.#hiddenIndices) this.#hidden = new Set(hidden);
    this.#hiddenIndices = hidden;
    if (selected !== this.#selected) {
      this.#selected = selected;
      const at = this.#shown.indexOf(selected);
      if (at >= 0) this.#activate(at);
    }
    this.#draw();
  }

  #filter() {
    const text = this.#search.value.trim().toLowerCase();
    const matches = ({ name }) => name.toLowerCase().includes(text);
    this.#shown = [...this.#objects.keys()].filter(i => matches(this.#objects[i]));
    this.#active = Math.max(0, this.#shown.indexOf(this.#selected));
    const [found, all] = [this.#shown.length, this.#objects.length];
    this.#count.textContent = text ? `${found} of ${all}` : `${all}`;
    this.#showFound.textContent = text ? "Show found" : "Show all";
    this.#hideFound.textContent = text ? "Hide found" : "Hide all";
    this.#list.scrollTop = 0;
    this.#draw();
  }

  #activate(position) {
    this.#active = Math.max(0, Math.min(this.#shown.length - 1, position));
    const top = this.#active * this.#rowHeight;
    const list = this.#list;
    if (top < list.scrollTop) list.scrollTop = top;
    const below = top + this.#rowHeight - list.clientHeight;
    if (below > list.scrollTop) list.scrollTop = below;
    this.#draw();
  }

  #draw() {
    const first = this.#rows.querySelector("[role=option]");
    if (first) this.#rowHeight = first.offsetHeight || this.#rowHeight;
    const height = this.#rowHeight;
    const from = Math.max(0, Math.floor(this.#list.scrollTop / height) - OVERSCAN);
    const to = Math.min(this.#shown.length, Math.ceil((this.#list.scrollTop + this.#list.clientHeight) / height) + OVERSCAN);
    // The active row is an element wherever it is, as screen readers read it.
    const positions = [];
    for (let i = from; i < to; i++) positions.push(i);
    if (this.#active < this.#shown.length && (this.#active < from || this.#active >= to)) positions.push(this.#active);
    this.#rows.style.height = `${this.#shown.length * height}px`;
    this.#list.style.setProperty("--rows", this.#rows.style.height);
    this.#rows.replaceChildren(...positions.map(position => this.#row(position, height)));
    this.#list.setAttribute("aria-activedescendant", this.#shown.length ? `object-${this.#shown[this.#active]}` : "");
  }

  #row(position, height) {
    const index = this.#shown[position];
    const { name, triangles } = this.#objects[index];
    const row = document.createElement("div");
    row.id = `object-${index}`;
    row.setAttribute("role", "option");
    row.setAttribute("aria-selected", index === this.#selected);
    row.setAttribute("aria-checked", !this.#hidden.has(index));
    row.setAttribute("aria-posinset", position + 1);
    row.setAttribute("aria-setsize", this.#shown.length);
    row.dataset.index = index;
    row.style.transform = `translateY(${position * height}px)`;
    row.classList.toggle("active", position === this.#active);
    const check = document.createElement("span");
    check.className = "check";
    const label = document.createElement("span");
    label.className = "name";
    label.textContent = name || `Object ${index + 1}`;
    label.title = label.textContent;
    const size = document.createElement("span");
    size.className = "size";
    size.textContent = triangles.toLocaleString("en");
    const unit = document.createElement("span");
    unit.className = "hidden";
    unit.textContent = triangles === 1 ? " triangle" : " triangles";
    size.append(unit);
    row.append(check, label, size);
    return row;
  }

  #toggle(index) {
    this.#actions.hide(index, !this.#hidden.has(index));
  }

  #click(event) {
    const row = event.target.closest("[role=option]");
    if (!row) return;
    const index = Number(row.dataset.index);
    this.#active = this.#shown.indexOf(index);
    if (event.target.classList.contains("check")) this.#toggle(index);
    else this.#actions.select(index === this.#selected ? null : index);
  }

  #press(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || !this.#shown.length) return;
    const page = Math.max(1, Math.floor(this.#list.clientHeight / this.#rowHeight) - 1);
    const steps = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
    const index = this.#shown[this.#active];
    if (event.key in steps) this.#activate(this.#active + steps[event.key]);
    else if (event.key === " ") this.#toggle(index);
    else if (event.key === "Enter") this.#actions.select(index === this.#selected ? null : index);
    else if (event.key === "Escape") this.#actions.select(null);
    else return;
    event.preventDefault();
  }
}
