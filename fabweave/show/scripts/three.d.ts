// What the bundle in three.js holds is typed as the library is.
export * from "three";
