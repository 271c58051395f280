// The button that chooses between light, dark and what the system says.
import { h } from "./dom";

type Theme = "auto" | "light" | "dark";

export function themeButton(): HTMLElement {
  const button = h("button", { type: "button", id: "theme" });
  const names: Record<Theme, string> = { auto: "◐ Auto", light: "☀ Light", dark: "☾ Dark" };
  const order: Theme[] = ["auto", "light", "dark"];
  let theme: Theme = "auto";
  const apply = (): void => {
    if (theme === "auto") delete document.documentElement.dataset["theme"];
    else document.documentElement.dataset["theme"] = theme;
    button.textContent = names[theme];
    button.setAttribute("aria-label", `Colours: ${theme}`);
  };
  button.addEventListener("click", () => { theme = order[(order.indexOf(theme) + 1) % order.length]!; apply(); });
  apply();
  return button;
}
