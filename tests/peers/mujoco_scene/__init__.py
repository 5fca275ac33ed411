"""Task files of the twin in MuJoCo: bodies, joints, drives and scripted motions, by MuJoCo's own contacts."""
