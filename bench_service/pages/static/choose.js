"use strict";
// Shows what is chosen at once. Another procedure has other quantities: the old one is not sent along.
for (const form of document.querySelectorAll("form.choose")) {
  form.addEventListener("change", (event) => {
    if (event.target.name === "procedure") form.elements.namedItem("quantity").disabled = true;
    form.submit();
  });
}
