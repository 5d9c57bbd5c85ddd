/* CRC-32C (Castagnoli, polynomial 0x1EDC6F41 reflected), as each page of an E57 file ends with. Any thread. */
#ifndef SPL_CLOUD_E57_CRC32C_H
#define SPL_CLOUD_E57_CRC32C_H

#include <stddef.h>
#include <stdint.h>

/* By the processor's instruction where it has one, else by the table. */
uint32_t spl_crc32c(const void *bytes, size_t length);

/* By the table alone: what the other is compared with. */
uint32_t spl_crc32c_table(const void *bytes, size_t length);

#endif
