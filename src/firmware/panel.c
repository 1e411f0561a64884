#include "panel.h"

#include "protocol.h"

bool panel_fits(const struct panel_parameters *p) {
  return p->lines >= PANEL_LEAST_LINES && p->lines <= PANEL_MOST_LINES && p->columns >= PANEL_LEAST_COLUMNS &&
         p->columns <= PANEL_MOST_COLUMNS;
}

/* --- contacts --- */

void panel_begin(struct panel *panel, const struct panel_parameters *parameters) {
  *panel = (struct panel){.parameters = *parameters};
}

uint8_t panel_inputs(struct panel *panel, struct board *board, uint32_t now_ms) {
  const uint8_t raw = board_inputs(board);
  uint8_t pressed = 0;
  for (int i = 0; i < BOARD_INPUTS; ++i) {
    const uint8_t bit = (uint8_t)(1 << i);
    if (!panel->begun) {
      panel->level = (uint8_t)(panel->level | (raw & bit));
      panel->steady_ms[i] = now_ms;
    } else if ((raw & bit) == (panel->level & bit)) {
      panel->steady_ms[i] = now_ms;
    } else if (now_ms - panel->steady_ms[i] >= panel->parameters.bounce_ms) {
      panel->level ^= bit;
      panel->steady_ms[i] = now_ms;
      pressed = (uint8_t)(pressed | (raw & bit));
    }
  }
  panel->begun = true;
  return pressed;
}

/* --- texts --- */

struct line {
  char text[PANEL_MOST_COLUMNS + 1];
  uint8_t length, columns;
};

static struct line empty_line(const struct panel *panel) {
  return (struct line){.columns = panel->parameters.columns};
}

/* Up to column `end`; what does not fit is left out. What a display cannot show is a question mark. */
static void put_until(struct line *line, const char *text, int end) {
  while (*text && line->length < end && line->length < line->columns) {
    const char c = *text++;
    line->text[line->length++] = c >= ' ' && c <= '~' ? c : '?';
  }
}

static void put(struct line *line, const char *text) { put_until(line, text, line->columns); }

static void pad(struct line *line, int end) {
  while (line->length < end && line->length < line->columns) line->text[line->length++] = ' ';
}

/* At least `digits` digits. */
static void put_number(struct line *line, uint32_t number, int digits) {
  char text[11];
  int at = 10;
  text[at] = 0;
  do {
    text[--at] = (char)('0' + number % 10);
    number /= 10;
  } while (at > 0 && (number > 0 || 10 - at < digits));
  put(line, text + at);
}

/* Five characters: minutes and seconds, else hours and minutes. */
enum { TIME_COLUMNS = 5 };
static void put_time(struct line *line, uint32_t seconds) {
  const uint32_t minutes = seconds / 60, hours = minutes / 60;
  if (hours > 99) {
    put(line, "> 99h");
    return;
  }
  put_number(line, minutes < 100 ? minutes : hours, 2);
  put(line, minutes < 100 ? ":" : "h");
  put_number(line, minutes < 100 ? seconds % 60 : minutes % 60, 2);
}

/* Label and zone, up to column `end`; a slave that stands in no list has its node ID. */
static void put_name(struct line *line, const struct panel *panel, uint16_t node, int end) {
  for (uint8_t i = 0; i < panel->parameters.place_count; ++i) {
    const struct alarm_place *place = &panel->parameters.places[i];
    if (place->node != node) continue;
    put_until(line, place->label, end);
    put_until(line, " ", end);
    put_until(line, place->zone, end);
    return;
  }
  put(line, "node ");
  put_number(line, node, 1);
}

static int length_of(const char *text) {
  int length = 0;
  while (text[length]) ++length;
  return length;
}

/* --- what there is besides alarms --- */

struct meaning {
  uint32_t bit;
  const char *text;
};

/* Of a slave only the first that fits is shown. */
static const struct meaning slave_meanings[] = {
    {PROTOCOL_SLAVE_ABSENT, "missing"},
    {PROTOCOL_SLAVE_WRONG, "wrong"},
    {PROTOCOL_SLAVE_CONFIGURATION, "FPGA bad"},
    {PROTOCOL_SLAVE_SHORT, "short"},
    {PROTOCOL_SLAVE_OPEN, "open"},
    {PROTOCOL_SLAVE_UNWATCHED, "off"},
    {PROTOCOL_SLAVE_HOST_DEAD, "host dead"},
    {PROTOCOL_SLAVE_UNWELL, "self-test"},
    {PROTOCOL_SLAVE_DROPPED, "dropped"},
    {PROTOCOL_SLAVE_DISABLED, "disabled"},
    {PROTOCOL_SLAVE_TEST_ALARM, "TEST fire"},
    {PROTOCOL_SLAVE_TESTING, "test"},
};
static const struct meaning master_meanings[] = {
    {PROTOCOL_MASTER_LINE_DEAD, "No slave answers"},
    {PROTOCOL_MASTER_RING_OPEN, "Ring cut before "},
    {PROTOCOL_MASTER_WRONG_LINE, "Slaves not as listed"},
    {PROTOCOL_MASTER_SERVER_SILENT, "Server silent"},
    {PROTOCOL_MASTER_HOST_DEAD, "Host was dead"},
    {PROTOCOL_MASTER_CONFIGURATION, "Master: FPGA bad"},
    {PROTOCOL_MASTER_MAINS, "Mains failed"},
    {PROTOCOL_MASTER_BATTERY, "Battery low"},
    {PROTOCOL_MASTER_EARTH, "Earth fault"},
    {PROTOCOL_MASTER_STORAGE, "Memory failed"},
    {PROTOCOL_MASTER_UNLISTED, "No slaves listed"},
    {PROTOCOL_MASTER_FULL, "Server takes nothing"},
    {PROTOCOL_MASTER_PLANT_DEAD, "No plant network"},
};
enum {
  SLAVE_MEANINGS = sizeof slave_meanings / sizeof slave_meanings[0],
  MASTER_MEANINGS = sizeof master_meanings / sizeof master_meanings[0]
};

static const char *meaning_of(uint16_t status) {
  for (int i = 0; i < SLAVE_MEANINGS; ++i)
    if (status & slave_meanings[i].bit) return slave_meanings[i].text;
  return 0;
}

/* Number `wanted` of what there is, from 0 on, into `line`; how many there are. Faults of the master come
 * first, then slaves with faults, then what is disabled or tested. */
static uint32_t find_item(const struct panel *panel, const struct line_picture *picture, uint32_t wanted,
                          struct line *line) {
  uint32_t count = 0;
  for (int i = 0; i < MASTER_MEANINGS; ++i) {
    if (!(picture->state & master_meanings[i].bit)) continue;
    if (count++ != wanted) continue;
    put(line, master_meanings[i].text);
    if (master_meanings[i].bit == PROTOCOL_MASTER_RING_OPEN) put_number(line, picture->cut + 1u, 1);
  }
  for (int faulty = 1; faulty >= 0; --faulty)
    for (int i = 0; i < picture->known; ++i) {
      const struct pictured_slave *s = &picture->slaves[i];
      const char *text = meaning_of(s->status);
      if (!text || (picture_faults(s->status) != 0) != faulty || count++ != wanted) continue;
      const int end = line->columns - 1 - length_of(text);
      /* Of who has never been seen only the place is known. */
      const bool expected = s->node == 0 && i < panel->parameters.place_count;
      put_name(line, panel, expected ? panel->parameters.places[i].node : s->node, end);
      pad(line, end + 1);
      put(line, text);
    }
  return count;
}

static uint32_t faults_of(const struct line_picture *picture) {
  uint32_t count = 0;
  for (int i = 0; i < MASTER_MEANINGS; ++i)
    if (picture->state & master_meanings[i].bit) ++count;
  for (int i = 0; i < picture->known; ++i)
    if (picture_faults(picture->slaves[i].status)) ++count;
  return count;
}

/* --- alarms --- */

/* The alarm number `wanted` from 0 on in the order in which they began; null: there are not so many. */
static const struct pictured_slave *find_alarm(const struct line_picture *picture, uint32_t wanted) {
  const struct pictured_slave *found = 0;
  uint16_t above = 0;
  for (uint32_t i = 0; i <= wanted; ++i) {
    found = 0;
    for (int k = 0; k < picture->known; ++k) {
      const struct pictured_slave *s = &picture->slaves[k];
      if (s->alarm > above && (!found || s->alarm < found->alarm)) found = s;
    }
    if (!found) return 0;
    above = found->alarm;
  }
  return found;
}

/* Which alarm it is, who, where, since when. */
static struct line alarm_line(const struct panel *panel, const struct line_picture *picture, uint32_t wanted,
                              uint32_t now_s) {
  struct line line = empty_line(panel);
  const struct pictured_slave *s = find_alarm(picture, wanted);
  if (!s) return line;
  put_number(&line, s->alarm, 1);
  put(&line, " ");
  const int end = line.columns - 1 - TIME_COLUMNS;
  put_name(&line, panel, s->node, end);
  pad(&line, end + 1);
  put_time(&line, now_s - s->since_s);
  return line;
}

static struct line fire_line(const struct panel *panel, const struct line_picture *picture) {
  struct line line = empty_line(panel);
  put(&line, "FIRE ");
  if (picture->alarms == 0) put(&line, "place unknown");
  else put_number(&line, picture->alarms, 1);
  put(&line, picture->state & PROTOCOL_MASTER_SOUNDING ? "" : " silenced");
  if (faults_of(picture) > 0) put(&line, " FLT");
  return line;
}

/* --- the display --- */

enum { RENEWALS = 20 }; /* looks at what is to be shown while a page stands: each takes its time */

static void show(struct panel *panel, struct board *board, int number, struct line *line) {
  pad(line, line->columns);
  line->text[line->columns] = 0;
  char *shown = panel->shown[number];
  bool same = true;
  for (int i = 0; i <= line->columns; ++i) {
    same = same && shown[i] == line->text[i];
    shown[i] = line->text[i];
  }
  if (!same) board_display(board, (uint8_t)number, shown);
}

/* The first alarm and the last one always stand there. With two or three lines the others share the line of
 * the last one, with four they have a line. */
static void show_alarms(struct panel *panel, struct board *board, const struct line_picture *picture,
                        uint32_t now_s) {
  const int lines = panel->parameters.lines;
  const uint32_t count = picture->alarms;
  int next = 0;
  if (lines > 2 || count == 0) {
    struct line head = fire_line(panel, picture);
    show(panel, board, next++, &head);
  }
  struct line first = alarm_line(panel, picture, 0, now_s);
  show(panel, board, next++, &first);
  struct line last = empty_line(panel), further = empty_line(panel);
  if (lines > 3) {
    if (count > 1) last = alarm_line(panel, picture, count - 1, now_s);
    if (count > 2) further = alarm_line(panel, picture, 1 + panel->page % (count - 2), now_s);
    show(panel, board, next++, &last);
    show(panel, board, next, &further);
  } else if (next < lines) {
    /* The last one has every other page. */
    const uint32_t page = panel->page;
    if (count > 2 && page % 2 == 1) last = alarm_line(panel, picture, 1 + page / 2 % (count - 2), now_s);
    else if (count > 1) last = alarm_line(panel, picture, count - 1, now_s);
    show(panel, board, next, &last);
  }
}

static void show_items(struct panel *panel, struct board *board, const struct line_picture *picture) {
  struct line head = empty_line(panel);
  const uint32_t faults = faults_of(picture), rows = panel->parameters.lines - 1u;
  struct line none = empty_line(panel);
  const uint32_t count = find_item(panel, picture, UINT32_MAX, &none);
  put(&head, faults > 0 ? "FAULT " : count > 0 ? "DISABLED OR TEST " : "No alarm, no fault");
  if (count > 0) put_number(&head, faults > 0 ? faults : count, 1);
  show(panel, board, 0, &head);
  const uint32_t pages = (count + rows - 1) / rows, page = pages > 1 ? panel->page % pages : 0;
  for (uint32_t row = 0; row < rows; ++row) {
    struct line line = empty_line(panel);
    find_item(panel, picture, page * rows + row, &line);
    if (count == 0 && row == 0) {
      put_number(&line, picture_present(picture), 1);
      put(&line, " slaves");
    }
    show(panel, board, (int)row + 1, &line);
  }
}

/* Every place of the display can be seen to work. */
static void show_test(struct panel *panel, struct board *board) {
  for (int i = 0; i < panel->parameters.lines; ++i) {
    struct line line = empty_line(panel);
    while (line.length < line.columns) put(&line, "#");
    show(panel, board, i, &line);
  }
}

void panel_show(struct panel *panel, struct board *board, const struct line_picture *picture, uint32_t now_ms,
                uint32_t now_s) {
  const uint16_t pause_ms = panel->parameters.page_ms / RENEWALS;
  if (panel->renewed && now_ms - panel->renewed_ms < pause_ms) return;
  panel->renewed = true;
  panel->renewed_ms = now_ms;
  if (now_ms - panel->paged_ms >= panel->parameters.page_ms) {
    panel->paged_ms = now_ms;
    ++panel->page;
  }
  if (panel->level & BOARD_TEST) show_test(panel, board);
  else if (picture->state & PROTOCOL_MASTER_FIRE || picture->alarms > 0)
    show_alarms(panel, board, picture, now_s);
  else show_items(panel, board, picture);
}
