/* "splatd serve" over the fake renderer of tests/support: load, losses and slow frames on demand. */
int spl_cmd_serve(int argc, char **argv);

int main(int argc, char **argv)
{
    return spl_cmd_serve(argc, argv);
}
