// Elements of the page, made of text only.

type Properties = {
  class?: string;
  text?: string;
  title?: string;
  type?: string;
  label?: string;
  role?: string;
  value?: string;
  min?: string;
  max?: string;
  step?: string;
  id?: string;
  for?: string;
  name?: string;
  disabled?: boolean;
  checked?: boolean;
  colour?: string;
  click?: () => void;
  input?: (value: string) => void;
  toggle?: (on: boolean) => void;
};

/** Text goes in as text: nothing of the data becomes markup. */
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  children: (Node | string | null)[] = [],
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  // The value comes after its limits, which would clip it.
  const set = (name: string, value: string | undefined) =>
    value !== undefined && made.setAttribute(name, value);
  set("class", properties.class);
  set("aria-label", properties.label);
  for (const name of [
    "title",
    "type",
    "role",
    "min",
    "max",
    "step",
    "value",
    "id",
    "for",
    "name",
  ] as const)
    set(name, properties[name]);
  if (properties.text !== undefined) made.textContent = properties.text;
  if (properties.colour) made.style.setProperty("--colour", properties.colour);
  if (properties.disabled) set("disabled", "");
  if (properties.checked) (made as unknown as HTMLInputElement).checked = true;
  const { click, input, toggle } = properties;
  if (click) made.addEventListener("click", click);
  if (input)
    made.addEventListener("input", () => input((made as unknown as HTMLInputElement).value));
  if (toggle)
    made.addEventListener("change", () => toggle((made as unknown as HTMLInputElement).checked));
  made.append(...children.filter((child) => child !== null));
  return made;
}

export function svg(
  tag: string,
  attributes: Record<string, string | number>,
  text?: string,
): SVGElement {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  if (text !== undefined) made.textContent = text;
  return made;
}

export const byId = (id: string): HTMLElement => document.getElementById(id)!;

/** Checkbox with a swatch of its colour and its words. */
export function checkbox(
  text: string,
  checked: boolean,
  toggle: (on: boolean) => void,
  colour?: string,
  extra?: string,
): HTMLElement {
  return element("label", { class: "check" }, [
    element("input", { type: "checkbox", checked, toggle }),
    colour ? element("span", { class: "swatch", colour }) : null,
    element("span", { class: "words", text }),
    extra ? element("span", { class: "extra", text: extra }) : null,
  ]);
}

/** Buttons of which one is chosen. */
export function choice<T extends string>(
  label: string,
  options: [T, string][],
  chosen: T,
  choose: (value: T) => void,
): HTMLElement {
  const group = element("div", { class: "choice", role: "group", label });
  for (const [value, text] of options) {
    const button = element("button", {
      type: "button",
      text,
      click: () => {
        for (const other of group.children)
          other.setAttribute("aria-pressed", String(other === button));
        choose(value);
      },
    });
    button.setAttribute("aria-pressed", String(value === chosen));
    group.append(button);
  }
  return group;
}

/** Terms with their values, a pair a row. */
export function terms(rows: [string, string][]): HTMLElement {
  return element(
    "dl",
    { class: "terms" },
    rows.flatMap(([term, value]) => [
      element("dt", { text: term }),
      element("dd", { text: value }),
    ]),
  );
}

/** Table with a heading; numbers are aligned at the right by the style. */
export function table(heading: string[], rows: string[][]): HTMLElement {
  const line = (cells: string[], tag: "th" | "td") =>
    element(
      "tr",
      {},
      cells.map((text) => element(tag, { text })),
    );
  return element("table", {}, [
    element("thead", {}, [line(heading, "th")]),
    element(
      "tbody",
      {},
      rows.map((row) => line(row, "td")),
    ),
  ]);
}

/** 1234567 as 1.23 M. */
export function short(count: number): string {
  if (count >= 1e6) return `${(count / 1e6).toFixed(count >= 1e7 ? 1 : 2)} M`;
  return count >= 1e4 ? `${Math.round(count / 1000)} k` : String(Math.round(count));
}

export const fixed = (value: number | null | undefined, digits: number, unit = ""): string =>
  typeof value === "number" && Number.isFinite(value) ? `${value.toFixed(digits)}${unit}` : "–";
