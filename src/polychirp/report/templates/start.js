/* Starts the parts of the page with the data that it carries. */
const pageData = JSON.parse(document.getElementById("data").textContent);
document.documentElement.classList.add("live"); /* shows what needs scripts */
if (pageData.rows.length) {
  startHeadline(pageData);
  startExplorer(pageData);
}
if (pageData.street) new StreetScene(document.getElementById("street"), pageData.street);
