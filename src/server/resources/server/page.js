// The live page: takes messages from /events, shows them, and sends commands. All text is set as text, never
// as HTML.
"use strict";

const LOG_SHOWN = 200;
const SILENCE_MS = 15000; // the server says something every 5 s

const $ = (selector, within = document) => within.querySelector(selector);
const token = $("meta[name=token]").content;

/** Sets what differs, so that nothing is drawn or read out anew without need. */
const set = (element, property, value) => { if (element[property] !== value) element[property] = value; };
const show = (element, text) => { set(element, "textContent", text || ""); set(element, "hidden", !text); };

const plural = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;

const localTime = iso => {
  const t = new Date(iso);
  const time = t.toLocaleTimeString(
    [], { hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" });
  return t.toDateString() === new Date().toDateString() ? time : `${t.toLocaleDateString()} ${time}`;
};

function listItems(list, texts) {
  while (list.children.length > texts.length) list.lastElementChild.remove();
  while (list.children.length < texts.length) list.append(document.createElement("li"));
  texts.forEach((text, i) => set(list.children[i], "textContent", text));
}

// Commands

const command = body => post("api/command", body);

/** Whether the server has taken it. */
async function post(path, body) {
  show($("#message"), "");
  try {
    const answer = await fetch(path, {
      method: "POST",
      headers: { "Content-Type": "application/json", "X-Token": token },
      body: JSON.stringify(body)
    });
    if (!answer.ok) show($("#message"), await answer.text());
    return answer.ok;
  } catch {
    show($("#message"), "The command could not be sent: no connection to the server.");
    return false;
  }
}

const orderStates = {
  waiting: "waits for the one before", next: "waits for the master's next report",
  sent: "sent, waiting for the master", done: "done", failed: "failed",
};
const orderText = o =>
  [`${o.text[0].toUpperCase()}${o.text.slice(1)}: ${orderStates[o.state]}`, o.progress, o.reason]
    .filter(Boolean).join(", ");

/** What is seen of those that an order would silence or reset: it shall not meet an alarm that is not. */
const ordersAbout = { silence: "sounding", reset: "burning" };
function shown(id, order) {
  const m = before && before.masters.find(m => m.id === id);
  const about = ordersAbout[order];
  return m && about ? { shown: m.slaves.filter(s => s[about]).map(s => s.position) } : {};
}

/** All buttons within that order something; `more` is what else the order says. */
function onOrders(within, more) {
  within.querySelectorAll("[data-order]").forEach(button =>
    button.addEventListener("click", () => {
      const order = button.dataset.order;
      command({ command: order, ...more(order) });
    }));
}

/** How long a detector is tested or disabled, as chosen within an element. */
const time = (within, order) =>
  order === "test" || order === "disable" ? { seconds: Number($(".time", within).value) } : {};

// The line

function slaveCard(id) {
  const card = $("#slave-template").content.cloneNode(true).firstElementChild;
  onOrders(card, order => ({
    master: id, node: Number(card.dataset.node), ...shown(id, order), ...time(card, order)
  }));
  return card;
}

function drawSlave(card, slave, isCut, canCommand) {
  const classes = `card ${slave.state}${isCut ? " is-cut" : ""}`;
  set(card, "className", classes);
  card.dataset.node = slave.node;
  card.dataset.state = slave.state;
  set($(".cut", card), "hidden", !isCut);
  const use = $("use", card), shape = `#shape-${slave.state}`;
  if (use.getAttribute("href") !== shape) use.setAttribute("href", shape);
  set($(".label", card), "textContent", slave.label);
  set($(".state", card), "textContent", slave.text);
  const notes = [...slave.zone ? [slave.zone] : [], `ID ${slave.node}`, ...slave.notes];
  set($(".notes", card), "textContent", notes.join(", "));
  set($(".reset", card), "ariaLabel", `Reset detector ${slave.label}`);
  card.querySelectorAll("button, select").forEach(b => set(b, "disabled", !canCommand || slave.twin));
}

function masterSection(id) {
  const section = $("#master-template").content.cloneNode(true).firstElementChild;
  section.dataset.master = id;
  set($("h2", section), "textContent", `Master ${id}`);
  onOrders($(".bar", section), order => ({ master: id, ...shown(id, order) }));
  const zones = $(".zones", section);
  $(".zone", zones).after($("#slave-template").content.querySelector(".time").cloneNode(true));
  onOrders(zones, order => ({ master: id, zone: $(".zone", zones).value, ...time(zones, order) }));
  return section;
}

function drawZones(section, zones) {
  set($(".zones", section), "hidden", zones.length === 0);
  const choice = $(".zone", section);
  if ([...choice.options].map(o => o.value).join("\n") !== zones.join("\n"))
    choice.replaceChildren(...zones.map(zone => new Option(zone, zone)));
}

function drawMaster(section, m) {
  const line = $(".line", section);
  while (line.children.length > m.slaves.length + 1) line.lastElementChild.remove();
  while (line.children.length < m.slaves.length + 1) line.append(slaveCard(m.id));
  const canCommand = !m.silent && !m.unproven && online;
  m.slaves.forEach((slave, i) => drawSlave(line.children[i + 1], slave, m.cut === i, canCommand));
  set($(".head .state", section), "textContent",
    m.unproven ? "not proven" : m.silent ? "silent" : m.selfTest);
  set(section, "className", m.silent || m.unproven ? "master is-silent" : "master");
  set($(".facts", section), "textContent", [
    m.heard ? `last report ${localTime(m.heard)}` : "no report since the server's start",
    `${plural(m.present, "slave")} answering`,
    `${plural(m.framesLost, "frame")} lost`,
    `${plural(m.refused, "datagram")} refused by the master`,
    ...m.life ? [`life ${m.life}`] : []
  ].join(" · "));
  show($(".signs", section), m.signs.join(" · "));
  listItems($(".notices", section), m.notices);
  listItems($(".orders", section), m.orders.slice(-3).map(orderText));
  drawZones(section, m.zones);
  section.querySelectorAll(".buttons button, .buttons select").forEach(b => set(b, "disabled", !canCommand));
}

// Rings

const SVG = "http://www.w3.org/2000/svg";
function svg(name, attributes, ...children) {
  const element = document.createElementNS(SVG, name);
  Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
  element.append(...children);
  return element;
}

/** The fibre behind a node, by the ports of those that are there: a lost node says nothing of it. */
const isCut = (node, next) =>
  node.state !== "lost" && !node.up[1] || next.state !== "lost" && !next.up[0];

function drawPicture(picture, r, width) {
  const n = r.nodes.length, narrow = width < 560;
  const height = Math.round(narrow ? Math.max(width, 260) : Math.min(width * .42, 420));
  const [rx, ry] = [width / 2 - 34, height / 2 - 30];
  const around = Math.PI * (3 * (rx + ry) - Math.sqrt((3 * rx + ry) * (rx + 3 * ry)));
  const size = Math.max(8, Math.min(30, around / Math.max(n, 1) * .62));
  const at = (i, out = 0) => {
    const angle = 2 * Math.PI * i / n - Math.PI / 2;
    return [width / 2 + (rx + out) * Math.cos(angle), height / 2 + (ry + out) * Math.sin(angle)];
  };
  const fibres = n < 2 ? [] : r.nodes.flatMap((node, i) => {
    const cut = !r.whole && isCut(node, r.nodes[(i + 1) % n]);
    const [[x1, y1], [x2, y2], [x, y]] = [at(i), at(i + 1), at(i + .5)];
    const line = svg("line", { x1, y1, x2, y2, class: cut ? "fibre is-cut" : "fibre" });
    return cut ? [line, svg("text", { x, y, class: "cut-mark" }, "✂")] : [line];
  });
  const nodes = r.nodes.map((node, i) => {
    const [[x, y], [tx, ty]] = [at(i), at(i, size / 2 + 12)];
    const title = svg("title", {}, `Node ${node.address}: ${[node.text, ...node.notes].join(", ")}`);
    const shape = svg("use", {
      href: `#shape-${node.state}`, x: x - size / 2, y: y - size / 2, width: size, height: size
    });
    const label = svg("text", { x: tx, y: ty }, String(node.address));
    return svg("g", { class: `${node.state}${node.gateway ? " gateway" : ""}` }, title, shape, label);
  });
  picture.setAttribute("viewBox", `0 0 ${width} ${height}`);
  picture.setAttribute("aria-label", `Ring of ${plural(n, "node")}: ${r.text}`);
  picture.replaceChildren(...fibres, ...nodes);
}

function ringSection(id) {
  const section = $("#ring-template").content.cloneNode(true).firstElementChild;
  section.dataset.ring = id;
  set($("h2", section), "textContent", `Ring ${id}`);
  $("form", section).addEventListener("submit", async event => {
    event.preventDefault();
    const text = $(".text", section), sent = text.value;
    const taken = await post("api/ring", {
      ring: id, node: Number($(".to", section).value), text: sent,
      urgent: $(".urgent", section).checked
    });
    // The next one may stand there already.
    if (taken && text.value === sent) text.value = "";
  });
  return section;
}

function drawRing(section, r) {
  set(section, "className", [
    "ring", ...r.broken ? ["is-broken"] : [], ...r.silent || r.unproven ? ["is-silent"] : []].join(" "));
  set($(".state", section), "textContent", r.unproven ? "not proven" : r.silent ? "silent" : r.text);
  set($(".facts", section), "textContent", [
    r.heard ? `last report ${localTime(r.heard)}` : "no report since the server's start",
    `${plural(r.present, "node")} there`,
    ...r.life ? [`life ${r.life}`] : []
  ].join(" · "));
  listItems($(".notices", section), r.notices);
  listItems($(".calls", section), r.urgent.map(m => `${localTime(m.received)} ${m.text}`).reverse());
  const picture = $(".picture", section);
  const width = Math.round(Math.max(300, section.clientWidth - 32 || 300));
  const shown = `${width} ${JSON.stringify([r.nodes, r.text])}`;
  if (picture.dataset.shown !== shown) {
    picture.dataset.shown = shown;
    drawPicture(picture, r, width);
    const odd = r.nodes.filter(node => node.state !== "normal" || node.notes.length);
    listItems($(".nodes", section),
      odd.map(node => `node ${node.address}: ${[node.text, ...node.notes].join(", ")}`));
    odd.forEach((node, i) => set($(".nodes", section).children[i], "className", node.state));
  }
  const to = [["0", "all nodes"], ...r.nodes.filter(node => !node.gateway)
    .map(node => [String(node.address), `node ${node.address}`]).sort((a, b) => a[0] - b[0])];
  const choice = $(".to", section);
  if ([...choice.options].map(o => o.value).join() !== to.map(t => t[0]).join()) {
    const chosen = choice.value;
    choice.replaceChildren(...to.map(([value, text]) => new Option(text, value)));
    if (to.some(t => t[0] === chosen)) choice.value = chosen;
  }
  listItems($(".orders", section), r.orders.slice(-3).map(o => `Message ${o.text}: ${o.state}`));
  section.querySelectorAll("form button, form input, form select")
    .forEach(b => set(b, "disabled", r.silent || r.unproven || !online));
}

/** Draws the sections of all of a kind, in their order, and removes those of others. */
function drawAll(root, key, all, make, drawOne) {
  const sections = new Map([...root.children].map(s => [Number(s.dataset[key]), s]));
  all.forEach((one, i) => {
    const section = sections.get(one.id) || make(one.id);
    sections.delete(one.id);
    if (root.children[i] !== section) root.insertBefore(section, root.children[i] || null);
    drawOne(section, one);
  });
  sections.forEach(section => section.remove());
}

/** Who burns, where, since when. The first and the last alarm are said to be so. */
function fireText(state) {
  const fires = state.masters.filter(m => m.fire);
  if (!fires.length) return "";
  const at = fires.flatMap(m => m.fire.at.map(f => ({ ...f, master: m.id })))
    .sort((a, b) => new Date(a.since) - new Date(b.since));
  const many = state.masters.length > 1;
  const one = (f, i) => (many ? `${f.master}/` : "") + f.label + (f.zone ? ` (${f.zone})` : "") +
    ` since ${localTime(f.since)}` +
    (at.length === 1 ? "" : i === 0 ? " (first alarm)" : i === at.length - 1 ? " (last alarm)" : "") +
    (f.smoke ? "" : ", smoke is gone");
  const unknown = fires.filter(m => !m.fire.at.length)
    .map(m => `Fire at master ${m.id}, detector not known.`);
  const known = at.length ? [`Fire at ${plural(at.length, "detector")}: ${at.map(one).join("; ")}.`] : [];
  const seen = fires.filter(m => m.fire.acknowledged).map(m =>
    `Acknowledged ${localTime(m.fire.acknowledged)}${many ? ` at master ${m.id}` : ""}.`);
  const silenced = fires.every(m => !m.fire.sounding) ? ["Sounders are off."] : [];
  return [...known, ...unknown, ...silenced, ...seen].join(" ");
}

let before = null; // the state last shown
let online = false;
let isCalled = false; // by an urgent message, since somebody has touched the page

const urgentOf = state => state.rings.flatMap(r => r.urgent);

/** Says what has changed to those who listen. */
function announce(state) {
  const states = s => new Map([
    ...urgentOf(s).map(m => [`urgent ${m.id}`, m.text]),
    ...s.masters.flatMap(m => m.slaves.map((d, i) => [`${m.id}/${i}`, `${d.label}: ${d.text}`])),
    ...s.rings.map(r => [`ring ${r.id}`, `Ring ${r.id}: ${r.text}`]),
    ...s.rings.flatMap(r => r.nodes.map(d => [`${r.id}.${d.address}`, `Node ${d.address}: ${d.text}`]))
  ]);
  if (before) {
    const old = states(before);
    const news = [...states(state)].filter(([key, text]) => old.get(key) !== text).map(([, text]) => text);
    if (urgentOf(state).some(m => !old.has(`urgent ${m.id}`))) isCalled = true;
    if (news.length) set($("#news"), "textContent", news.slice(0, 8).join(", "));
  }
  before = state;
}

function draw(state) {
  drawAll($("#masters"), "master", state.masters, masterSection, drawMaster);
  drawAll($("#rings"), "ring", state.rings, ringSection, drawRing);

  const fire = fireText(state);
  show($("#alarm"), fire);
  const burning = state.masters.reduce((n, m) => n + (m.fire ? Math.max(m.fire.at.length, 1) : 0), 0);
  const what = state.rings.length && !state.masters.length ? "Fibre ring" : "Smoke alarm";
  set($("h1"), "textContent", state.rings.length && state.masters.length ? "Plant" : what);
  set($("#empty"), "hidden", state.masters.length + state.rings.length > 0);
  show($("#broken"), state.broken);
  const refused = Object.entries(state.refused).map(([name, n]) => `${name} ${n}`);
  set($("#refused"), "textContent", refused.join(", "));
  announce(state);
  const fires = burning ? [`▲ ${plural(burning, "alarm")}`] : [];
  const signs = isCalled ? [...fires, "▲ urgent message"] : fires;
  document.title = [...signs, `flyframe ${what.toLowerCase()}`].join(" – ");
}

// The log, newest first

function logRow(entry, manyMasters) {
  const row = document.createElement("tr");
  row.className = entry.severity;
  row.dataset.id = entry.id;
  const id = entry.ring ? "node" : "ID";
  const where = entry.label || (entry.node === null ? "" : `${id} ${entry.node}`);
  const cells = [localTime(entry.received), manyMasters ? `${entry.master}/${where}` : where, entry.text];
  row.append(...cells.map(text => {
    const cell = document.createElement("td");
    cell.textContent = text;
    return cell;
  }));
  $("td", row).title = entry.received;
  return row;
}

function drawLog(entries, fresh, manyMasters) {
  const log = $("#log");
  if (fresh) log.replaceChildren();
  entries.forEach(entry => log.prepend(logRow(entry, manyMasters)));
  while (log.children.length > LOG_SHOWN) log.lastElementChild.remove();
  const note = log.children.length === LOG_SHOWN ? `The last ${LOG_SHOWN} events; the CSV file has all.` : "";
  set($("#log-note"), "textContent", note);
}

// Messages of the server

let source = null, watchdog = 0;

function setOnline(value) {
  online = value;
  set($("#connection"), "className", value ? "connection" : "connection off");
  set($("#connection"), "textContent", value ? "live" : "not connected");
  set($("#offline"), "hidden", value);
  document.body.classList.toggle("offline", !value);
  if (!value && before) draw(before); // without buttons
}

function connect() {
  if (source) source.close();
  source = new EventSource("events");
  watch();
  source.onmessage = message => {
    watch();
    if (!online) setOnline(true);
    const { state, log, fresh } = JSON.parse(message.data);
    draw(state);
    drawLog(log, fresh, state.masters.length + state.rings.length > 1);
  };
  source.onerror = () => {
    setOnline(false);
    // The browser tries again by itself, but not after every error.
    if (source.readyState === EventSource.CLOSED) setTimeout(connect, 2000);
  };
}

function watch() {
  clearTimeout(watchdog);
  watchdog = setTimeout(() => { setOnline(false); connect(); }, SILENCE_MS);
}

const drawAgain = () => { if (before) draw(before); };
addEventListener("resize", drawAgain);
["pointerdown", "keydown"].forEach(touch => addEventListener(touch, () => {
  if (isCalled) { isCalled = false; drawAgain(); }
}));
connect();
