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

async function command(body) {
  show($("#message"), "");
  try {
    const answer = await fetch("api/command", {
      method: "POST",
      headers: { "Content-Type": "application/json", "X-Token": token },
      body: JSON.stringify(body)
    });
    if (!answer.ok) show($("#message"), await answer.text());
  } catch {
    show($("#message"), "The command could not be sent: no connection to the server.");
  }
}

const orderStates = {
  waiting: "waits for the one before", sent: "sent, waiting for the master", done: "done", failed: "failed",
};
const orderText = o =>
  `${o.text[0].toUpperCase()}${o.text.slice(1)}: ${orderStates[o.state]}${o.reason ? `, ${o.reason}` : ""}`;

// The line

function slaveCard(id) {
  const card = $("#slave-template").content.cloneNode(true).firstElementChild;
  $(".reset", card).addEventListener("click", () =>
    command({ master: id, command: "reset", node: Number(card.dataset.node) }));
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
  set($(".notes", card), "textContent", [`ID ${slave.node}`, ...slave.notes].join(", "));
  const reset = $(".reset", card);
  set(reset, "ariaLabel", `Reset detector ${slave.label}`);
  set(reset, "disabled", !canCommand || slave.twin);
}

function masterSection(id) {
  const section = $("#master-template").content.cloneNode(true).firstElementChild;
  section.dataset.master = id;
  set($("h2", section), "textContent", `Master ${id}`);
  $(".clear", section).addEventListener("click", () => command({ master: id, command: "clear" }));
  return section;
}

function drawMaster(section, m, state) {
  const line = $(".line", section);
  while (line.children.length > m.slaves.length + 1) line.lastElementChild.remove();
  while (line.children.length < m.slaves.length + 1) line.append(slaveCard(m.id));
  const canCommand = state.commands && !m.silent && online;
  m.slaves.forEach((slave, i) => drawSlave(line.children[i + 1], slave, m.cut === i, canCommand));
  set($(".head .state", section), "textContent", m.silent ? "silent" : m.selfTest);
  set($(".facts", section), "textContent", [
    m.heard ? `last report ${localTime(m.heard)}` : "no report since the server's start",
    `${m.present} of ${plural(m.known, "slave")} answering`,
    `${plural(m.framesLost, "frame")} lost`,
    `boot number ${m.boot}`
  ].join(" · "));
  listItems($(".notices", section), m.notices);
  listItems($(".orders", section), m.orders.slice(-3).map(orderText));
  const clear = $(".clear", section);
  set(clear, "disabled", !canCommand);
  set(clear, "title", state.commands ? "" : "The server was started without a key.");
}

let before = null; // the state last shown
let online = false;

/** Says what has changed to those who listen. */
function announce(state) {
  const states = s => new Map(
    s.masters.flatMap(m => m.slaves.map((d, i) => [`${m.id}/${i}`, `${d.label}: ${d.text}`])));
  if (before) {
    const old = states(before);
    const news = [...states(state)].filter(([key, text]) => old.get(key) !== text).map(([, text]) => text);
    if (news.length) set($("#news"), "textContent", news.slice(0, 8).join(", "));
  }
  before = state;
}

function draw(state) {
  const root = $("#masters");
  const sections = new Map([...root.children].map(s => [Number(s.dataset.master), s]));
  state.masters.forEach((m, i) => {
    const section = sections.get(m.id) || masterSection(m.id);
    sections.delete(m.id);
    if (root.children[i] !== section) root.insertBefore(section, root.children[i] || null);
    drawMaster(section, m, state);
  });
  sections.forEach(section => section.remove());

  const alarms = state.masters.flatMap(m =>
    m.alarms.map(label => state.masters.length > 1 ? `${m.id}/${label}` : label));
  const detectors = plural(alarms.length, "detector");
  show($("#alarm"), alarms.length ? `Alarm at ${detectors}: ${alarms.join(", ")}` : "");
  document.title = (alarms.length ? `▲ ${plural(alarms.length, "alarm")} – ` : "") + "flyframe smoke alarm";
  set($("#empty"), "hidden", state.masters.length > 0);
  show($("#broken"), state.broken);
  const refused = Object.entries(state.refused).map(([name, n]) => `${name} ${n}`);
  set($("#refused"), "textContent", refused.join(", "));
  announce(state);
}

// The log, newest first

function logRow(entry, manyMasters) {
  const row = document.createElement("tr");
  row.className = entry.severity;
  row.dataset.id = entry.id;
  const where = entry.label || (entry.node === null ? "" : `ID ${entry.node}`);
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
    drawLog(log, fresh, state.masters.length > 1);
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

connect();
