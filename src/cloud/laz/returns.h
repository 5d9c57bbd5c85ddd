/* Contexts by the number of a return and the count of its pulse: parts of the format. Pure. */
#ifndef SPL_CLOUD_LAZ_RETURNS_H
#define SPL_CLOUD_LAZ_RETURNS_H

/* Sixteen kinds, of counts and numbers up to 7: rows are counts. Both orders of a pair are one kind. */
static inline unsigned spl_laz_returns16(unsigned count, unsigned number)
{
    static const unsigned char kinds[8][8] = {
        {15, 14, 13, 12, 11, 10, 9, 8},  {14, 0, 1, 3, 6, 10, 10, 9},    {13, 1, 2, 4, 7, 11, 11, 10},
        {12, 3, 4, 5, 8, 12, 12, 11},    {11, 6, 7, 8, 9, 13, 13, 12},   {10, 10, 11, 12, 13, 14, 14, 13},
        {9, 10, 11, 12, 13, 14, 15, 14}, {8, 9, 10, 11, 12, 13, 14, 15},
    };
    return kinds[count][number];
}

/* Six kinds, of counts and numbers up to 15. */
static inline unsigned spl_laz_returns6(unsigned count, unsigned number)
{
    static const unsigned char kinds[16][17] = {
        "0123453445555555", "1013333333333333", "2124444444433333", "3345444444444444",
        "4344544444444444", "5344454444444444", "3344445444444444", "4344444544444444",
        "4344444454444444", "5344444445444444", "5344444444544444", "5334444444455444",
        "5334444444455544", "5334444444445554", "5334444444444555", "5334444444444455",
    };
    return kinds[count][number] - '0';
}

/* How far a return is from the last of its pulse, at most 7. */
static inline unsigned spl_laz_return_level(unsigned count, unsigned number)
{
    unsigned level = count > number ? count - number : number - count;
    return level < 7 ? level : 7;
}

#endif
