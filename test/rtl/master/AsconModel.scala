package flyframe.master

/** Ascon-AEAD128 as NIST SP 800-232 writes it down, words of 64 bits at a time: the tag of associated data
  * without plaintext.
  */
object AsconModel {
  private def word(bytes: Seq[Int], at: Int): Long =
    (0 until 8).map(i => (bytes(at + i) & 0xffL) << (8 * i)).reduce(_ | _)
  private def bytes(word: Long): Seq[Int] = (0 until 8).map(i => (word >>> (8 * i) & 0xff).toInt)

  private def round(s: Array[Long], number: Int): Unit = {
    s(2) ^= ((15 - number) << 4 | number).toLong
    s(0) ^= s(4); s(4) ^= s(3); s(2) ^= s(1)
    val t = Array.tabulate(5)(i => s(i) ^ (~s((i + 1) % 5) & s((i + 2) % 5)))
    t(1) ^= t(0); t(0) ^= t(4); t(3) ^= t(2); t(2) = ~t(2)
    for ((by, i) <- Seq((19, 28), (61, 39), (1, 6), (10, 17), (7, 41)).zipWithIndex)
      s(i) = t(i) ^ java.lang.Long.rotateRight(t(i), by._1) ^ java.lang.Long.rotateRight(t(i), by._2)
  }

  /** @param key
    *   16 bytes, as the nonce
    */
  def tag(key: Seq[Int], nonce: Seq[Int], message: Seq[Int]): Seq[Int] = {
    val k = Seq(word(key, 0), word(key, 8))
    val s = Array(0x00001000808c0001L, k.head, k.last, word(nonce, 0), word(nonce, 8))
    def permute(rounds: Int): Unit = for (r <- 12 - rounds until 12) round(s, r)
    def keyAt(first: Int): Unit    = for (i <- 0 to 1) s(first + i) ^= k(i)
    permute(12)
    keyAt(3)
    if (message.nonEmpty)
      for (block <- (message :+ 1).padTo((message.size / 16 + 1) * 16, 0).grouped(16)) {
        for (i <- 0 to 1) s(i) ^= word(block, 8 * i)
        permute(8)
      }
    s(4) ^= 1L << 63
    s(0) ^= 1
    keyAt(2)
    permute(12)
    keyAt(3)
    bytes(s(3)) ++ bytes(s(4))
  }

  /** The known answers of the designers: the tag of 0x30, 0x31 and so on, by the number of bytes. */
  lazy val known: Seq[Seq[Int]] =
    scala.io.Source
      .fromResource("ascon/tags.txt")
      .getLines()
      .filterNot(_.startsWith("#"))
      .toSeq
      .map(_.grouped(2).map(Integer.parseInt(_, 16)).toSeq)
  val knownKey: Seq[Int]   = 0 until 16
  val knownNonce: Seq[Int] = 0x10 until 0x20
}
