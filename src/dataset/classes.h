/* What classes of scans are called: those of the LAS specification (ASPRS), and none of a dataset's own. Pure. */
#ifndef SPL_DATASET_CLASSES_H
#define SPL_DATASET_CLASSES_H

/* "high vegetation" of 5; NULL where the number has no name. */
const char *spl_class_name(double value);

/* Those that people ask for by name, with their numbers, for messages. */
#define SPL_CLASSES_LISTED                                                                                             \
    "2 is ground, 3-5 low to high vegetation, 6 building, 7 and 18 noise, 9 water, 11 road, 13-14 wires, 15 tower, "   \
    "17 bridge"

#endif
