"""Files that are dropped anywhere on the page: handed to the field for files that is shown."""

SCRIPT = """
const fileFields = (root) => [...root.querySelectorAll("*")].flatMap((one) => [
  ...(one.matches("input[type=file]") ? [one] : []), ...(one.shadowRoot === null ? [] : fileFields(one.shadowRoot))])
for (const what of ["dragover", "drop"]) {
  document.addEventListener(what, (event) => {
    if (![...event.dataTransfer.types].includes("Files")) return
    event.preventDefault()
    const field = fileFields(document).find((one) => one.checkVisibility())
    event.dataTransfer.dropEffect = field === undefined ? "none" : "copy"
    if (what !== "drop" || field === undefined) return
    field.files = event.dataTransfer.files
    field.dispatchEvent(new Event("change"))
  })
}
"""
"""Without it a browser would leave the page and show a file that misses the field. A screen without such a field takes none."""
