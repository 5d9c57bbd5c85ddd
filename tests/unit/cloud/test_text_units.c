/* Units in headings of texts: found in whatever spelling, taken where all axes agree, and no part of a name. */
#include "cloud_test.h"

/* What headings say of x and y, and of z; in metres, -1 of degrees. */
static void headings_name_units(void **state)
{
    static const double us_ft = 1200.0 / 3937;
    const struct {
        const char *text;
        double unit, height;
        const char *told; /* of what does not go together, or contradicts itself */
    } rows[] = {
        {"x[m] y[m] z[m]\n1 2 3\n", 1, 1, ""},
        {"x [m] y [m] z [m] r g b\n1 2 3 4 5 6\n", 1, 1, ""},
        {"//X(m),Y(m),Z(m)\n1,2,3\n", 1, 1, ""},
        {"X (US ft),Y (US ft),Z (US ft)\n1,2,3\n", us_ft, us_ft, ""},
        {"X [us-ft];Y [ftUS];Z [US survey foot]\n1;2;3\n", us_ft, us_ft, ""},
        {"Easting (Feet),Northing (ft),Elevation (FT)\n1,2,3\n", 0.3048, 0.3048, ""},
        {"easting_ft,northing_ft,height_ft\n1,2,3\n", 0.3048, 0.3048, ""},
        {"x_m y_m z_m\n1 2 3\n", 1, 1, ""},
        {"x[m] y[m] z[ft]\n1 2 3\n", 1, 0.3048, ""},
        {"x[mm] y[mm] z\n1 2 3\n", 0.001, 0, ""},
        {"x;y;z\nm;m;m\n1;2;3\n", 1, 1, ""},
        {"x y z\n[mm] [mm] [mm]\n1 2 3\n", 0.001, 0.001, ""},
        {"x;y;z;i\nft;ft;ft;0-255\n1;2;3;9\n", 0.3048, 0.3048, ""},
        {"x[deg],y[deg],z[m]\n1,2,3\n", -1, 1, ""},
        {"Ost;Nord;HOEHE UEBER NHN [m]\n1;2;3\n", 0, 0, "z in m"},
        {"x[m] y[ft] z[m]\n1 2 3\n", 0, 0, "x in m, y in ft, z in m"},
        {"x[m] y[deg] z\n1 2 3\n", 0, 0, "x in m, y in degrees"},
        {"x y z\n1 2 3\n", 0, 0, ""},
        {"x(0-255) y(0-255) z(0-255)\n1 2 3\n", 0, 0, ""},
        {"x[UTM32] y[UTM32] z[NHN]\n1 2 3\n", 0, 0, ""},
        {"x y z r(ft) foo_m\n1 2 3 4 5\n", 0, 0, ""},
        {"X_usft,Y_usft,Z_usft\n1,2,3\n", us_ft, us_ft, ""},
        {"x_us_ft,y_US_ft,z_us-ft\n1,2,3\n", us_ft, us_ft, ""},
        {"Easting_USft,Northing US survey feet,Height_ftUS\n1,2,3\n", us_ft, us_ft, ""},
        {"x_mm y_mm z_mm\n1 2 3\n", 0.001, 0.001, ""},
        {"X / m;Y / m;Z / m\n1;2;3\n", 1, 1, ""},
        {"X/cm Y/cm Z/cm\n1 2 3\n", 0.01, 0.01, ""},
        {"X in m;Y in m;Z in km\n1;2;3\n", 1, 1000, ""},
        {"POINT_X_m,posY_m,E_m,N_m,z_coord (m)\n1,2,4,5,3\n", 1, 1, ""},
        {"E_m,N_m,H_m\n1,2,3\n", 1, 1, ""},
        {"x_yards,y_yd,z_yd\n1,2,3\n", 0.9144, 0.9144, ""},
        {"PktNr;Y_m;X_m;H_m\n7;1;2;3\n", 1, 1, ""},
        {"x;y;z\ndeg;deg;m\n1;2;3\n", -1, 1, ""},
        {"x_deg,y_deg,z_m\n1,2,3\n", -1, 1, ""},
        {"x_ft,y_usft,z_ft\n1,2,3\n", 0, 0, "x in ft, y in us-ft, z in ft"},
        {"x_m,y_m,z_deg\n1,2,3\n", 0, 0, "x in m, y in m, z in degrees"},
        {"x;y;z\nm;ft;m\n1;2;3\n", 0, 0, "x in m, y in ft, z in m"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_cloud *cloud;
        struct spl_error err = {0};
        write_scratch(rows[i].text, strlen(rows[i].text));
        if (spl_cloud_open(scratch_path(), NULL, &cloud, &err))
            fail_msg("%zu: %s", i, err.message);
        const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
        const struct spl_cloud_coordinates *c = &info->coordinates;
        double unit = c->angles ? -1 : c->unit_m;
        const char *told = strstr(rows[i].told, "y in") ? c->apart : info->units;
        if (unit != rows[i].unit || c->height_unit_m != rows[i].height || strcmp(told, rows[i].told) != 0 ||
            (told[0] && c->apart[0] && info->units[0]))
            fail_msg("%zu: %g, %g, \"%s\", \"%s\"", i, unit, c->height_unit_m, info->units, c->apart);
        spl_cloud_destroy(cloud);
    }
    struct loaded l;
    load_text("x,y,z,r_m,g_m,b_m\n1,2,3,4,5,6\n", NULL, &l); /* lengths are no colours */
    assert_int_equal(l.attributes, 0);
    assert_string_equal(l.unused, "r_m, g_m, b_m");
    loaded_finish(&l);
    load_text("z_m,z,y,x,x_m\n9,3,2,1,9\n", NULL, &l); /* what is called so itself comes first */
    assert_point(&l, 0, 1, 2, 3);
    loaded_finish(&l);
    refused_text("x_in,y_in,z_in\n1,2,3\n", SPL_E_INPUT, "x", "no column has this name"); /* it may be anything */
    refused_text("lon_deg,lat_deg,h_m\n1,2,3\n", SPL_E_INPUT, "x", "in degrees");
    struct spl_cloud *cloud;
    const struct spl_cloud_options options = {.columns = "x,y,z"};
    write_scratch("x[m],y[m],z[m]\n1,2,3\n", 21);
    assert_int_equal(spl_cloud_open(scratch_path(), &options, &cloud, NULL), 0);
    assert_true(spl_cloud_get_info(cloud)->coordinates.unit_m == 0); /* headings are not read then */
    spl_cloud_destroy(cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(headings_name_units),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
