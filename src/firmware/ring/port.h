/* What a board must supply to the transport: the CAN port through which its frames leave. Frames that come
 * are handed to `transport_receive`. */
#ifndef FLYFRAME_RING_PORT_H
#define FLYFRAME_RING_PORT_H

#include "frame.h"

/* The board's own: handed through, never looked into. */
struct board;

/* Hands a frame to the port, which sends it when its turn has come, in CAN order, and repeats it until it
 * was sent. The transport never has more frames there than its configuration says (`slots`), and never two
 * with the same identifier; for so many the port always has a place. */
void board_frame_send(struct board *board, const struct ring_frame *frame);

/* Whether the frame with this identifier still waits in the port: neither sent nor given up. When it has been
 * sent, every node that can be reached has got it. */
bool board_frame_waits(struct board *board, uint32_t id);

#endif
