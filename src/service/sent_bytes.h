/* What a TCP connection has sent, and what was read of it. */
#ifndef SPL_SERVICE_SENT_BYTES_H
#define SPL_SERVICE_SENT_BYTES_H

#include <stdint.h>

/* Bytes that were written to the connection `fd` since it began, headers included; 0 when the kernel does not say. */
uint64_t spl_sent_bytes(int fd);

/* How many bytes that came were read, the end of the stream counting as one; SPL_TAKEN_UNKNOWN where the kernel does
 * not say. Of the thread that reads them. */
#define SPL_TAKEN_UNKNOWN UINT64_MAX
uint64_t spl_taken_bytes(int fd);

#endif
