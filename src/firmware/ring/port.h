/* What the transport needs of the CAN port through which its frames leave: src/firmware/node has it for the
 * nodes of this project. Frames that come are handed to `transport_receive`. */
#ifndef FLYFRAME_RING_PORT_H
#define FLYFRAME_RING_PORT_H

#include "frame.h"

/* Handed through, never looked into. */
struct can_port;

/* Hands a frame to the port, which sends it when its turn has come, in CAN order, and repeats it until it
 * was sent; false: there is no place. The transport never has more frames there than its configuration says
 * (`slots`), and never two with the same identifier; for so many the port always has a place. */
bool can_port_send(struct can_port *port, const struct ring_frame *frame);

/* Whether the frame with this identifier still waits in the port, or is on the wire: neither sent nor given
 * up. When it has been sent, every node that can be reached has got it. */
bool can_port_waits(const struct can_port *port, uint32_t id);

/* Takes the frame with this identifier back: it does not leave any more, unless it is on the wire. It waits
 * until that is certain. */
void can_port_abort(struct can_port *port, uint32_t id);

#endif
