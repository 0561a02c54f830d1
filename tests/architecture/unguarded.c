// Built without any of the guards that deploy/check-hardening looks for.
int main(void) { return 0; }
