/* What identifies what is drawn: its index in the dataset, or as what it is drawn (SPL_DRAWN_*). GROUP is the kernel's
 * constant 0. */
#ifndef SPL_DRAWN_GLSL
#define SPL_DRAWN_GLSL

const bool IDENTIFIES = GROUP == SPL_SUMS_ID || GROUP == SPL_SUMS_PRIMITIVE;

uint identity(uint drawn, uint id)
{
    return GROUP == SPL_SUMS_PRIMITIVE ? drawn : id;
}

#endif
