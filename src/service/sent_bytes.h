/* What a TCP connection has sent. */
#ifndef SPL_SERVICE_SENT_BYTES_H
#define SPL_SERVICE_SENT_BYTES_H

#include <stdint.h>

/* Bytes that were written to the connection `fd` since it began, headers included; 0 when the kernel does not say. */
uint64_t spl_sent_bytes(int fd);

#endif
