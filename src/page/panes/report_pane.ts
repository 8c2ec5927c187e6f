// Report of a merge: tables and charts in a dialog over the page.
import { byId, element } from "../dom";

/** The policy of the page permits no style of its content; what the script sets counts. */
function styled(content: DocumentFragment): CSSStyleSheet[] {
  const sheets = [...content.querySelectorAll("style")].map((style) => {
    const rules = new CSSStyleSheet();
    rules.replaceSync(style.textContent ?? "");
    style.remove();
    return rules;
  });
  for (const part of content.querySelectorAll<HTMLElement | SVGElement>("[data-style]")) {
    part.style.cssText = part.dataset["style"] ?? "";
  }
  return sheets;
}

/** Adds a button to the head where the page holds a report. Its HTML is the program's own, with every text from outside escaped. */
export function reportPane(): void {
  const template = document.getElementById("report");
  if (!(template instanceof HTMLTemplateElement)) return;
  const content = element("div", { class: "report-content" });
  const root = content.attachShadow({ mode: "open" });
  const parts = document.importNode(template.content, true);
  root.adoptedStyleSheets = styled(parts);
  root.append(parts);
  const dialog = document.createElement("dialog");
  dialog.id = "report-dialog";
  dialog.setAttribute("aria-label", "Report");
  dialog.append(element("button", { type: "button", class: "close", text: "close", click: () => dialog.close() }), content);
  document.body.append(dialog);
  byId("theme").before(element("button", { id: "report-button", type: "button", text: "report", click: () => dialog.showModal() }));
}
