/* The panel of a master: buttons and other contacts, which bounce, and a text display: who is in alarm,
 * where, since when; what is wrong while nobody is. */
#ifndef FLYFRAME_PANEL_H
#define FLYFRAME_PANEL_H

#include "line_picture.h"

/* Where a slave is, for people. The texts are printable ASCII and stay where they are. */
struct alarm_place {
  uint16_t node; /* ID of the slave */
  const char *label, *zone;
};

enum { PANEL_LEAST_LINES = 2, PANEL_MOST_LINES = 4, PANEL_LEAST_COLUMNS = 20, PANEL_MOST_COLUMNS = 40 };

struct panel_parameters {
  uint8_t lines, columns; /* of the display: 2 to 4 of 20 to 40 */
  uint16_t bounce_ms;     /* how long a contact must stand to count */
  uint16_t page_ms;       /* how long a page of the display stands, if there are several */
  const struct alarm_place *places;
  uint8_t place_count;
};

struct panel {
  struct panel_parameters parameters;
  /* Of contacts: what counts, and since when each was like that, in ms of the master's time. */
  bool begun;
  uint8_t level;
  uint32_t steady_ms[BOARD_INPUTS];
  /* Of the display. */
  bool renewed;
  uint32_t page, paged_ms, renewed_ms;
  char shown[PANEL_MOST_LINES][PANEL_MOST_COLUMNS + 1];
};

/* There are displays like that. */
bool panel_fits(const struct panel_parameters *parameters);

void panel_begin(struct panel *panel, const struct panel_parameters *parameters);

/* Takes in what the contacts are. Returns those that have just become 1; `panel->level` says how all are.
 * What is pressed at the start counts from its next time on; what is wrong then counts at once. */
uint8_t panel_inputs(struct panel *panel, struct board *board, uint32_t now_ms);

/* Writes the lines that are not shown yet, twenty times while a page stands. */
void panel_show(struct panel *panel, struct board *board, const struct line_picture *picture, uint32_t now_ms,
                uint32_t now_s);

#endif
